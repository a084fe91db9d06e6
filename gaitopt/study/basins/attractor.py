"""Attractors: a walk is simulated step by step until it repeats or fails."""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.stability.cycle import slips_throughout
from gaitopt.stability.section import Section

if TYPE_CHECKING:  # the simulation of robots with several contacts imports scipy
    from gaitopt.simulation.planar_simulation.planar_state import PlanarState
    from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker, PlanarWalkStep

UNSETTLED = "unsettled"


@dataclass(frozen=True, eq=False)
class WalkEnding:
    """The ending of a walk.

    Attributes
    ----------
    label : str
        Contact sequences of the gait it converged to, the key of a :class:`gaitopt.Stop`, or ``"unsettled"``.
    z : (n_z,) array
        Last point on the section with foot speed.
    steps : int
        Number of steps.
    """

    label: str
    z: Array
    steps: int


@check_arguments
@frozen(kw_only=True)
class SettlingCriterion:
    """Criterion by which a walk counts as converged to a gait.

    Attributes
    ----------
    steps : int
        Maximum number of steps.
    tolerance : float
        Largest change of the state over a period, for two consecutive periods, for which the walk repeats.
    longest_period : int
        Longest period that is detected, in steps; the contact sequences of its steps are joined by ``"; "``.

    Examples
    --------
    >>> SettlingCriterion(steps=20).tolerance
    1e-06
    """

    steps: int = field(default=100, validator=whole_number())
    tolerance: float = field(default=1e-6, validator=positive())
    longest_period: int = field(default=4, validator=whole_number())


def classify_walk(walker: Walker, z: Array, criterion: SettlingCriterion | None = None) -> WalkEnding:
    """Walk from a point of the section with foot speed until it repeats, fails, or reaches the maximum number of steps.

    A gait that slips throughout repeats in all coordinates but its foot speed, and counts as converged only if that
    speed drifts away from zero; if it drifts towards zero, the foot comes to rest and the walk converges to another
    gait.

    Parameters
    ----------
    walker : Walker
    z : (n_z,) array
        Coordinates of ``Section(robot, p, sliding=True)``.
    criterion : SettlingCriterion, optional
    """
    section = _section_of(walker)
    walk = _StepWalk(walker.walk_step, lambda state: state[section.places].tolist(), _repeats, _sequence_of)
    return _follow_walk(walk, section.embed(z), criterion or SettlingCriterion())


@functools.lru_cache(maxsize=8)
def _section_of(walker: Walker) -> Section:
    """Return the section of the walks of a walker, the same one for all starts."""
    return Section(walker.robot, walker.p, sliding=True)


def classify_planar_walk(
    walker: "PlanarWalker", start: "PlanarState", kept: list[int], criterion: SettlingCriterion
) -> WalkEnding:
    """Walk a robot with several contacts until it repeats, fails, or reaches the maximum number of steps.

    Parameters
    ----------
    walker : PlanarWalker
    start : PlanarState
        State right after the section.
    kept : list of int
        Entries of the state (q, v) that repeat in a gait: all except the position along the ground.
    criterion : SettlingCriterion
    """
    walk = _StepWalk(walker.walk_step, lambda state: state.y[kept].tolist(), _are_close, _planar_sequence_of)
    return _follow_walk(walk, start, criterion)


class _StepWalk(NamedTuple):
    """Functions that take the steps of a walk and compare them.

    Attributes
    ----------
    walk_step : callable
        State -> step with its `following` state and its `stop`.
    point : callable
        State -> list of its coordinates; floats are much faster than arrays for a few numbers.
    repeats : callable
        (point, a later one, step, tolerance) -> whether they are equal.
    sequence : callable
        Step -> its contact sequence, or None.
    """

    walk_step: Callable[[Any], Any]
    point: Callable[[Any], list[float]]
    repeats: Callable[[list[float], list[float], Any, float], bool]
    sequence: Callable[[Any], str | None]


def _follow_walk(walk: _StepWalk, state: Any, criterion: SettlingCriterion) -> WalkEnding:
    """Walk from a state until it repeats, fails, or reaches the maximum number of steps."""
    point, walk_steps = walk.point(state), list[Any]()
    points, calm, tolerance = [point], [0] * (criterion.longest_period + 1), criterion.tolerance
    for step in range(1, criterion.steps + 1):
        walk_step = walk.walk_step(state)
        if walk_step.following is None:
            return WalkEnding(walk_step.stop.key if walk_step.stop else UNSETTLED, np.array(point), step)
        state = walk_step.following
        point = walk.point(state)
        for period in range(1, min(step, criterion.longest_period) + 1):
            before = points[-period]
            # The first coordinate shows that most walks do not repeat.
            if abs(point[0] - before[0]) > tolerance or not walk.repeats(before, point, walk_step, tolerance):
                calm[period] = 0
                continue
            calm[period] += 1
            if calm[period] == 2 * period:
                label = _label([walk.sequence(each) for each in [*walk_steps, walk_step][-period:]])
                return WalkEnding(label, np.array(point), step)
        points.append(point)
        walk_steps.append(walk_step)
    return WalkEnding(UNSETTLED, np.array(point), criterion.steps)


def _repeats(before: list[float], after: list[float], walk_step: WalkStep, tolerance: float) -> bool:
    """Return whether two points are equal; in complete slip, except for a foot speed that drifts away from zero."""
    if walk_step.impact is not None and slips_throughout(walk_step.modes, walk_step.impact.mode):
        if (after[-1] - before[-1]) * after[-1] <= 0:
            return False
        before, after = before[:-1], after[:-1]
    return _are_close(before, after, walk_step, tolerance)


def _are_close(before: list[float], after: list[float], walk_step: Any, tolerance: float) -> bool:
    """Return whether two points are equal."""
    return all(abs(a - b) <= tolerance for a, b in zip(after, before, strict=True))


def _sequence_of(walk_step: WalkStep) -> str | None:
    """Return the contact sequence of a step."""
    return (
        str(ContactSequence(walk_step.modes, walk_step.impact.mode))
        if walk_step.impact and walk_step.impact.mode
        else None
    )


def _planar_sequence_of(walk_step: "PlanarWalkStep") -> str:
    """Return the contact sequence of a step; labels contain no commas."""
    return walk_step.rollout.motion.sequence.replace(", ", " and ")


def _label(sequences: list[str | None]) -> str:
    """Return the contact sequences of a period, starting with the first in alphabetical order."""
    known = [sequence for sequence in sequences if sequence is not None]
    return "; ".join(min(known[i:] + known[:i] for i in range(len(known))))
