"""Diagnosis of a solution: violated constraints by phase, node and name, inaccuracy of the plan, and warnings."""

from typing import Protocol

import numpy as np

from gaitopt.motion.gait import Violation
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Key, Place, Unknown
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.swing_foot_checks import SCUFF, early_touchdown, lack_of_height
from gaitopt.ocp.solution.trajectory import BetweenNodes
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach
from gaitopt.ocp.transcription.transcription import Transcription

SHORT_STEP = 0.03
"""Step length, as a fraction of the longest possible one, below which a step is unusually short."""

ROUNDING = 1e-7
"""Violation of a contact mode below which it is due to the tolerance of the solver."""

LEAST_RESERVE = 1e-9
"""Least distance from another contact mode inside a phase at which the simulator remains in the mode."""

LARGEST_GROWTH = 3e7
"""Growth of errors above which replays with different integrators deviate by more than 1e-6 after the touchdown: their
errors at the end of a slip are up to 3e-14 rad/s."""


class NamedLayouts(Protocol):
    """A transcription of a problem: the layouts of its unknowns and of its constraint rows."""

    @property
    def variables(self) -> Layout:
        """Layout of the decision vector."""

    @property
    def constraints(self) -> Layout:
        """Layout of the constraint rows."""


def violations(
    transcription: NamedLayouts, bounds: Bounds, x: Array, g: Array, *, above: float = 1e-6, most: int = 10
) -> tuple[Violation, ...]:
    """Return the worst violations of constraints and bounds, largest first, one for each name in each phase.

    Parameters
    ----------
    x, g : arrays
        Decision vector and constraint values.
    above : float
        Least violation that is listed.
    most : int
        Largest length of the list.
    """
    entries: list[tuple[float, Place, Key]] = []
    for layout, value, lower, upper in (
        (transcription.constraints, g, bounds.g_lower, bounds.g_upper),
        (transcription.variables, x, bounds.x_lower, bounds.x_upper),
    ):
        excess = np.maximum(lower - value, value - upper)
        excess = np.where(np.isnan(excess), np.inf, excess)
        for index in np.argsort(-excess):
            if excess[index] <= above:
                break
            entries.append((float(excess[index]), *layout.entries[index]))
    worst: dict[tuple[Place, Key], Violation] = {}
    for size, place, key in sorted(entries, key=lambda entry: -entry[0]):
        section = place._replace(node=None, between=False)
        worst.setdefault((section, key.at(0)), Violation(place.label, key.label, size))
        if len(worst) == most:  # a failed solve violates hundreds of rows
            break
    return tuple(worst.values())


def report_inaccuracies(
    transcription: Transcription, problem: GaitProblem, x: Array, error: float, between: BetweenNodes
) -> tuple[str, ...]:
    """Return the reasons why the plan of a solution is inaccurate, one sentence each; empty if it is accurate.

    The sentences concern the error between nodes, contact modes violated there, and a swing foot that is too low or
    touches down before the end.

    Parameters
    ----------
    x : array
        Decision vector.
    error : float
        Error between nodes, or of the energy balance, after the last refinement.
    between : BetweenNodes
        Contact modes between the nodes.
    """
    sentences = []
    if not error <= problem.transcription.tolerance:
        sentences.append(
            f"the error between nodes is {error:.1e}, but the tolerance is "
            f"{problem.transcription.tolerance:.1e}: use more intervals."
        )
    if not between.outside <= ROUNDING:
        sentences.append(
            f"the contact mode is violated by {between.outside:.1e} between nodes: use more intervals, or larger "
            f"Margins (cone, normal_force, slip_speed, sliding_inertia)."
        )
    elif not between.reserve > LEAST_RESERVE:
        sentences.append(
            f"the foot changes its contact mode between nodes: its least distance from another mode is "
            f"{between.reserve:.1e} (share of the friction cone in stick, foot speed [m/s] in slip); use larger "
            f"Margins (cone, slip_speed)."
        )
    low = lack_of_height(transcription, problem, x)
    if not low <= SCUFF:
        sentences.append(f"the swing foot is {low:.1e} m below Limits.clearance between nodes: use more intervals.")
    early = early_touchdown(transcription, problem, x)
    if early is not None and early.grazes:
        sentences.append(
            f"the swing foot does not approach the ground from above after {early.place}, so a replay does not locate "
            f"the touchdown at the end of the plan; try a larger Margins.touchdown_rate, or another step_length or "
            f"speed."
        )
    elif early is not None:
        sentences.append(
            f"the plan touches down before its end, after {early.place}, and its replay ends the step there: try "
            f"another step_length or speed, or Limits.clearance for a walker with knees."
        )
    return tuple(sentences)


def report_growth(growth: float) -> tuple[str, ...]:
    """Return a sentence if errors grow so much over the step that no replay confirms the plan."""
    if growth <= LARGEST_GROWTH:
        return ()
    return (
        f"an error at the end of a slip is {growth:.1e} times as large after the touchdown, so rounding errors exceed "
        f"the tolerance of a replay; try another sequence, speed or step_length, or smaller torque limits.",
    )


def report_short_phases(transcription: Transcription, problem: GaitProblem, x: Array) -> tuple[str, ...]:
    """Return a sentence for each phase of minimum duration."""
    shortest = problem.limits.shortest_phase
    durations = x[transcription.variables[Unknown.DURATION][0]]
    return tuple(
        f"{phase.place().label} lasts {shortest:g} s, the minimum: a sequence without this phase may have a lower cost."
        for phase, duration in zip(transcription.phases, durations, strict=True)
        if duration < 1.01 * shortest
    )


def report_short_steps(transcription: Transcription, problem: GaitProblem, x: Array) -> tuple[str, ...]:
    """Return a sentence if the speed is free and the step length is at its lower bound or unusually short."""
    step, travel = problem.step_length_range, float(x[transcription.variables[Unknown.TRAVEL][0, 0]])
    if problem.speed_range.lower > 0 or step.lower == step.upper:
        return ()
    reach = find_longest_reach(problem.robot, problem.values, problem.limits.angles(problem.robot.angles))
    if travel > max(SHORT_STEP * reach, (1 + 1e-4) * step.lower):
        return ()
    reason = f"far shorter than the reach of {reach:.3g} m" if step.lower == 0 else "its lower bound"
    return (
        f"the speed is free, and the step length decreases to {travel:.3g} m, {reason}: the cost decreases as speed "
        f"and step length decrease, so the problem has no interior optimum. Fix the speed, or specify a lower bound "
        f"for it.",
    )
