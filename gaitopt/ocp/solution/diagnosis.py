"""Which constraints are not met, by phase, node and name; and what in a solution deserves a look."""

from dataclasses import replace

import numpy as np

from gaitopt.motion.gait import Violation
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.keys import Key, Place, Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.swing_foot_checks import SCUFF, early_touchdown, lack_of_height
from gaitopt.ocp.transcription.transcription import Transcription

ROUNDING = 1e-7
"""Violations of a contact mode below this are the solver's tolerance, not the grid's."""


def violations(
    transcription: Transcription, bounds: Bounds, x: Array, g: Array, *, above: float = 1e-6, most: int = 10
) -> tuple[Violation, ...]:
    """Return the worst violations of constraints and bounds, largest first, one for each name in each phase.

    Parameters
    ----------
    x, g : arrays
        Decision vector and constraint values.
    above : float
        Smaller violations are not listed.
    most : int
        Length of the list.
    """
    found: list[tuple[float, Place, Key]] = []
    for layout, value, lower, upper in (
        (transcription.constraints, g, bounds.g_lower, bounds.g_upper),
        (transcription.variables, x, bounds.x_lower, bounds.x_upper),
    ):
        excess = np.maximum(lower - value, value - upper)
        excess = np.where(np.isnan(excess), np.inf, excess)
        for index in np.argsort(-excess):
            if excess[index] <= above:
                break
            found.append((float(excess[index]), *layout.entries[index]))
    worst: dict[tuple[Place, Key], Violation] = {}
    for size, place, key in sorted(found, key=lambda entry: -entry[0]):
        section = replace(place, node=None, between=False)
        worst.setdefault((section, key.at(0)), Violation(place.label, key.label, size))
    return tuple(worst.values())[:most]


def warnings(
    transcription: Transcription, problem: GaitProblem, x: Array, error: float, outside: float
) -> tuple[str, ...]:
    """Return what in a solution deserves a look: durations that rest on their bounds, a grid that is too coarse.

    A swing foot that is too low between nodes, or touches down before the end, is told of, too.

    Parameters
    ----------
    x : array
        Decision vector.
    error : float
        Error between nodes, or of the energy ledger, after the last refinement.
    outside : float
        By how much a contact mode is violated between nodes.
    """
    found = []
    if not error <= problem.transcription.tolerance:
        found.append(
            f"the plan is only accurate to {error:.1e} between nodes, not to the tolerance "
            f"{problem.transcription.tolerance:.1e}: use more intervals."
        )
    if not outside <= ROUNDING:
        found.append(
            f"between nodes the contact leaves its mode by {outside:.1e}: use more intervals, or larger Margins "
            f"(cone, normal_force, slip_speed)."
        )
    low = lack_of_height(transcription, problem, x)
    if not low <= SCUFF:
        found.append(
            f"between nodes the swing foot is {low:.1e} m lower than Limits.clearance asks: use more intervals."
        )
    early = early_touchdown(transcription, problem, x)
    if early is not None:
        found.append(
            f"the plan touches down before its end, after {early.place}, and its replay will end the step there: try "
            f"another step_length or speed, or Limits.clearance for a walker with knees."
        )
    shortest = problem.limits.shortest_phase
    for phase in transcription.phases:
        if x[transcription.variables[Unknown.DURATION][0, phase.number]] < 1.01 * shortest:
            found.append(
                f"{phase.place().label} lasts {shortest:g} s, the minimum: a sequence without it may be better."
            )
    return tuple(found)
