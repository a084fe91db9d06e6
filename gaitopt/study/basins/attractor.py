"""Attractors: a walk is simulated step by step until it repeats or fails."""

from dataclasses import dataclass

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.hybrid_automaton import Stride, Walker
from gaitopt.stability.cycle import slips_throughout
from gaitopt.stability.section import Section

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


def classify_walk(walker: Walker, z: Array, patience: SettlingCriterion | None = None) -> WalkEnding:
    """Walk from a point of the section with foot speed until it repeats, fails, or reaches the maximum number of steps.

    A gait that slips throughout repeats in all coordinates but its foot speed, and counts as converged only if that
    speed drifts away from zero; if it drifts towards zero, the foot comes to rest and the walk converges to another
    gait.

    Parameters
    ----------
    walker : Walker
    z : (n_z,) array
        Coordinates of ``Section(robot, p, sliding=True)``.
    patience : SettlingCriterion, optional
    """
    patience = patience or SettlingCriterion()
    section = Section(walker.robot, walker.p, sliding=True)
    state, places = section.embed(z), section.places
    # Floats are much faster than arrays for a few numbers.
    point, strides = state[places].tolist(), list[Stride]()
    points, calm, tolerance = [point], [0] * (patience.longest_period + 1), patience.tolerance
    for step in range(1, patience.steps + 1):
        stride = walker.stride(state)
        if stride.following is None:
            return WalkEnding(stride.stop.key if stride.stop else UNSETTLED, np.array(point), step)
        state, point = stride.following, stride.following[places].tolist()
        for period in range(1, min(step, patience.longest_period) + 1):
            before = points[-period]
            # The first coordinate shows that most walks do not repeat.
            if abs(point[0] - before[0]) > tolerance or not _repeats(before, point, stride, tolerance):
                calm[period] = 0
                continue
            calm[period] += 1
            if calm[period] == 2 * period:
                return WalkEnding(_label([*strides, stride][-period:]), np.array(point), step)
        points.append(point)
        strides.append(stride)
    return WalkEnding(UNSETTLED, np.array(point), patience.steps)


def _repeats(before: list[float], after: list[float], stride: Stride, tolerance: float) -> bool:
    """Return whether two points are equal; in complete slip, except for a foot speed that drifts away from zero."""
    if stride.impact is not None and slips_throughout(stride.modes, stride.impact.mode):
        if (after[-1] - before[-1]) * after[-1] <= 0:
            return False
        before, after = before[:-1], after[:-1]
    return all(abs(a - b) <= tolerance for a, b in zip(after, before, strict=True))


def _label(strides: list[Stride]) -> str:
    """Return the contact sequences of a period, starting with the first in alphabetical order."""
    sequences = [
        str(ContactSequence(stride.modes, stride.impact.mode))
        for stride in strides
        if stride.impact and stride.impact.mode
    ]
    return "; ".join(min(sequences[i:] + sequences[:i] for i in range(len(sequences))))
