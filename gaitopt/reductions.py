"""Reductions in which nan counts as the worst value, so that a failure does not disappear in a maximum.

``max(0.0, nan)`` is 0.0 in Python, and ``nan > limit`` is False.
"""

import math
from typing import Any

import numpy as np


def worst(*values: Any) -> float:
    """Return the largest of numbers and entries of arrays; infinite if one of them is nan, -inf without any.

    Parameters
    ----------
    *values : float or array

    Examples
    --------
    >>> worst(0.0, [1.0, 2.0]), worst(0.0, float("nan"))
    (2.0, inf)
    """
    largest = -math.inf
    for value in values:
        entries = np.asarray(value, dtype=float)
        if entries.size:
            size = float(entries.max())
            if math.isnan(size):
                return math.inf
            largest = max(largest, size)
    return largest


def rank_of(value: float) -> float:
    """Return a number to sort by, smallest first; infinite for nan.

    Examples
    --------
    >>> sorted([float("nan"), 2.0, 1.0], key=rank_of)
    [1.0, 2.0, nan]
    """
    return math.inf if math.isnan(value) else float(value)
