"""Limits that a chart of values shows: those near the values, so that far limits do not flatten the curves."""

from collections.abc import Iterable

import numpy as np

from gaitopt.motion.motion import Array

NEAR = 0.5
"""Distance from the values to a limit that is shown, at most, over the range of the values and zero."""


def select_near_limits(values: Array, limits: Iterable[float]) -> list[float]:
    """Return the finite limits near some values, in order.

    Parameters
    ----------
    values : (K,) array
    limits : iterable of float

    Examples
    --------
    >>> select_near_limits(np.array([-1.0, 5.0]), [6.0, -6.0, 30.0])
    [6.0]
    """
    low, high = min(float(np.min(values, initial=0.0)), 0.0), max(float(np.max(values, initial=0.0)), 0.0)
    reach = NEAR * (high - low)
    return [limit for limit in limits if np.isfinite(limit) and low - reach <= limit <= high + reach]
