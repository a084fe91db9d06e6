"""Reason for which a walk after a push does not return to its gait."""

from gaitopt.motion.motion import Array
from gaitopt.stability.pushed_walk import PushedWalk

ENDED, LEFT, SLOW = "ended", "left", "slow"
"""The walk ends; its distance from the gait does not decrease; it decreases, but the walk has too few steps."""


def classify_unreturned_walk(walk: PushedWalk, push: Array, steps: int) -> str:
    """Return the reason for which a walk of a number of steps does not return to its gait: ENDED, LEFT or SLOW.

    The distance counts as decreasing if the largest one in the second half of the steps is smaller than the largest
    one in the first half: the distances of an oscillating or sheared deviation do not decrease in every step.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> halving = SimpleNamespace(begin=float, take_step=lambda state: state / 2, distance=abs)
    >>> classify_unreturned_walk(halving, 1.0, 4)
    'slow'
    """
    state, distances = walk.begin(push), list[float]()
    for _ in range(steps):
        state = walk.take_step(state)
        if state is None:
            return ENDED
        distances.append(walk.distance(state))
    half = steps // 2
    if half == 0:  # one distance has no trend
        return SLOW
    return SLOW if max(distances[half:]) < max(distances[:half]) else LEFT
