"""Deflation of known fixed points, so that Newton's method converges to others.

The residual F(z) = P(z) - z is multiplied by m(z), the product of 1 + 1 / |(z - z_k) / s_k|^2 over known points z_k.
The product m F has no zero at a known point; elsewhere it has the zeros of F (Farrell, Birkisson & Funke 2015).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.motion.motion import Array

MIN_DENOMINATOR = 0.1
"""Smallest denominator by which a Newton step is divided; a deflated step is at most ten times as long."""


class KnownPoint(NamedTuple):
    """A known fixed point.

    Attributes
    ----------
    z : (n_z,) array
    scale : (n_z,) array
        Distance in each coordinate up to which the point repels the iteration.
    """

    z: Array
    scale: Array


class Deflation:
    """Factor that repels Newton's method from known fixed points.

    Parameters
    ----------
    points : sequence of KnownPoint

    Examples
    --------
    >>> deflation = Deflation([KnownPoint(np.zeros(1), np.ones(1))])
    >>> deflation.factor(np.array([0.5])), deflation.step_ratio(np.array([1.0]), np.array([0.5]))
    (5.0, 0.6666666666666666)
    """

    def __init__(self, points: Sequence[KnownPoint] = ()) -> None:
        self._points = tuple(points)

    def factor(self, z: Array) -> float:
        """Return m(z), which is infinite at a known point."""
        factor = 1.0
        for known in self._points:
            offset = (z - known.z) / known.scale
            square = float(offset @ offset)
            factor *= 1 + 1 / square if square else np.inf
        return factor

    def step_ratio(self, z: Array, direction: Array) -> float:
        """Return the ratio of the Newton step of m F to the Newton step d of F, which are parallel.

        It is 1 / (1 - grad m . d / m), which is negative if the deflated step leads away from a known point.
        """
        slope = 0.0
        for known in self._points:
            offset = (z - known.z) / known.scale
            square = float(offset @ offset)
            slope -= 2 * float(offset @ (direction / known.scale)) / (square * (square + 1)) if square else 0.0
        denominator = 1 - slope
        return float(1 / np.copysign(max(abs(denominator), MIN_DENOMINATOR), denominator))
