"""Certificate of the optimum on one grid."""

from dataclasses import replace

import numpy as np

from gaitopt.motion.certificate import Certificate, NearConstraint, Sensitivity
from gaitopt.ocp.nlp.keys import Key, Kind, Place
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.nlp.second_order import SecondOrder, check_second_order
from gaitopt.ocp.solution.grid_solve import GridSolution
from gaitopt.ocp.solution.relaxable_limits import typical_sizes
from gaitopt.ocp.solution.sensitivity import cost_sensitivities

NEAREST = 5
"""Number of inactive constraints that are listed."""

AUXILIARY = (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER, Kind.SLACK)
"""Kinds of unknowns without a physical bound."""


def certify(solution: GridSolution) -> Certificate | None:
    """Return the certificate of a solution on one grid; None if the solve failed.

    Parameters
    ----------
    solution : GridSolution
    """
    transcription, outcome = solution.transcription, solution.outcome
    if not outcome.status.ok:
        return None
    sizes = typical_sizes(transcription, solution.problem)
    check = check_second_order(transcription.nlp, outcome.x, outcome.multipliers, solution.data, solution.limits, sizes)
    sensitivities = cost_sensitivities(solution.problem, transcription, outcome.x, outcome.multipliers, solution.data)
    return make_certificate(check, (transcription.variables, transcription.constraints), sensitivities)


def make_certificate(
    check: SecondOrder, layouts: tuple[Layout, Layout], sensitivities: tuple[Sensitivity, ...]
) -> Certificate:
    """Return the certificate of a check of the second-order conditions.

    Parameters
    ----------
    check : SecondOrder
    layouts : (Layout, Layout)
        Layouts of the unknowns and of the constraint rows.
    sensitivities : tuple of Sensitivity
    """
    return Certificate(
        verdict=check.verdict.value,
        active=check.active.size,
        weak=check.weak.size,
        dependent=check.dependent,
        free_directions=check.free_directions,
        curvature=check.curvature,
        nearest=_nearest(check, layouts),
        sensitivities=sensitivities,
    )


def _nearest(check: SecondOrder, layouts: tuple[Layout, Layout]) -> tuple[NearConstraint, ...]:
    """Return the inactive constraints nearest to their bounds, one for each name in each phase."""
    entries = [entry for layout in layouts for entry in layout.entries]
    distances = check.slacks.copy()
    nearest: dict[tuple[Place, Key], NearConstraint] = {}
    distances[check.active] = np.inf
    for index in np.argsort(distances):
        place, key = entries[index]
        if not np.isfinite(distances[index]) or len(nearest) == NEAREST:
            break
        if key.kind not in AUXILIARY:
            section = replace(place, node=None, between=False)
            constraint = NearConstraint(place.label, key.label, float(distances[index]))
            nearest.setdefault((section, key.at(0)), constraint)
    return tuple(nearest.values())
