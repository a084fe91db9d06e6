"""Certificate of the optimum on one grid."""

import numpy as np

from gaitopt.lazy import Deferred
from gaitopt.motion.certificate import Certificate, NearConstraint, Sensitivity
from gaitopt.ocp.nlp.keys import Key, Kind, Place
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.nlp.second_order import SecondOrder, SecondOrderCheck
from gaitopt.ocp.solution.grid_solve import GridSolution
from gaitopt.ocp.solution.relaxable_limits import typical_sizes
from gaitopt.ocp.solution.sensitivity import cost_sensitivities

NEAREST = 5
"""Number of inactive constraints that are listed."""

AUXILIARY = (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER, Kind.SLACK)
"""Kinds of unknowns without a physical bound."""


class Certification:
    """The certificate of a solution on one grid, part of which is computed in another thread.

    Parameters
    ----------
    solution : GridSolution
    """

    def __init__(self, solution: GridSolution) -> None:
        self._solution = solution
        self._check: SecondOrderCheck | None = None

    def begin(self) -> None:
        """Begin to check the second-order conditions, if the solve has succeeded."""
        solution, outcome = self._solution, self._solution.outcome
        if self._check is None and outcome.status.ok:
            sizes = typical_sizes(solution.transcription, solution.problem)
            point = outcome.x, outcome.multipliers, solution.data, solution.limits
            self._check = SecondOrderCheck(solution.transcription.nlp, *point, sizes)

    def conclude(self) -> Certificate | None:
        """Return the certificate; None if the solve failed."""
        self.begin()
        if self._check is None:
            return None
        problem, transcription, outcome = self._solution.problem, self._solution.transcription, self._solution.outcome
        point = outcome.x, outcome.multipliers, self._solution.data
        sensitivities = cost_sensitivities(problem, transcription, *point)  # while the other thread may be at work
        layouts = transcription.variables, transcription.constraints
        return make_certificate(self._check.conclude(), layouts, sensitivities)


def defer_certificate(solution: GridSolution) -> Deferred[Certificate | None]:
    """Return the certificate of a solution on one grid, None if the solve failed, for a field of a gait.

    Parameters
    ----------
    solution : GridSolution
    """
    certification = Certification(solution)
    return Deferred(certification.conclude, begin=certification.begin)


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
            section = place._replace(node=None, between=False)
            constraint = NearConstraint(place.label, key.label, float(distances[index]))
            nearest.setdefault((section, key.at(0)), constraint)
    return tuple(nearest.values())
