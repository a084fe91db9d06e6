"""Reason for which a walk after a push does not return to its gait."""

from collections.abc import Mapping

from gaitopt.motion.motion import Array
from gaitopt.stability.pushed_walk import PushedWalk
from gaitopt.status import Stop

ENDED, LEFT, SLOW = "ended", "left", "slow"
"""The walk ends; its distance from the gait does not decrease; it decreases, but the walk has too few steps."""


def classify_unreturned_walk(walk: PushedWalk, push: Array, steps: int) -> tuple[str, Stop | None]:
    """Return the reason for which a walk of a number of steps does not return: ENDED, LEFT or SLOW; and how it ended.

    The distance counts as decreasing if the largest one in the second half of the steps is smaller than the largest
    one in the first half: the distances of an oscillating or sheared deviation do not decrease in every step.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> halving = SimpleNamespace(begin=float, take_step=lambda state: state / 2, distance=abs)
    >>> classify_unreturned_walk(halving, 1.0, 4)
    ('slow', None)
    """
    state, distances = walk.begin(push), list[float]()
    for _ in range(steps):
        following = walk.take_step(state)
        if following is None:
            return ENDED, walk.find_stop(state)
        state = following
        distances.append(walk.distance(state))
    half = steps // 2
    slow = half == 0 or max(distances[half:]) < max(distances[:half])  # one distance has no trend
    return SLOW if slow else LEFT, None


def summarise_failures(counts: Mapping[str, int]) -> str:
    """Return SLOW if all walks need more steps, otherwise the more frequent one of ENDED and LEFT; empty without walks.

    Examples
    --------
    >>> summarise_failures({"slow": 9, "ended": 1}), summarise_failures({"slow": 9}), summarise_failures({})
    ('ended', 'slow', '')
    """
    if counts.get(ENDED) or counts.get(LEFT):
        return ENDED if counts.get(ENDED, 0) >= counts.get(LEFT, 0) else LEFT
    return SLOW if counts.get(SLOW) else ""
