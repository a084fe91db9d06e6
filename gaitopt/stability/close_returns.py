"""Close returns of walks: points to which a walk returns closely after some steps, starts for gaits of that period."""

from collections.abc import Iterable

import numpy as np

from gaitopt.motion.motion import Array

LARGEST_DISTANCE = 0.3
"""Largest distance of a return, relative to the natural size of the coordinates."""
RETURNS_PER_PERIOD = 4
"""Number of returns used as starts, for each period."""


def close_returns(walks: Iterable[Array], period: int) -> list[tuple[int, int]]:
    """Return the points with the closest returns after a number of steps, closest first, as (walk, number in the walk).

    Each walk contributes one point.  A point is omitted if the distance after a divisor of the period is less than
    twice that after the period.

    Parameters
    ----------
    walks : iterable of (K, n_z) arrays
        Points of each walk, divided by the natural size of each coordinate.
    period : int

    Examples
    --------
    >>> walk = np.array([[0.0], [1.0], [0.1], [0.9], [0.12]])
    >>> close_returns([walk], 2), close_returns([walk], 4)
    ([(0, 2)], [])
    """
    closest = []
    for number, walk in enumerate(walks):
        if len(walk) <= period:
            continue
        distance = _distances(walk, period)
        for divisor in (d for d in range(1, period) if period % d == 0):
            distance[2 * distance > _distances(walk, divisor)[: distance.size]] = np.inf
        at = int(np.argmin(distance))
        if distance[at] < LARGEST_DISTANCE:
            closest.append((float(distance[at]), number, at))
    return [(number, at) for _, number, at in sorted(closest)[:RETURNS_PER_PERIOD]]


def _distances(walk: Array, steps: int) -> Array:
    """Return the distance of each point of a walk to the point some steps later, shape (K - steps,)."""
    return np.asarray(np.max(np.abs(walk[steps:] - walk[:-steps]), axis=1))
