"""Deflation of known fixed points, so that Newton's method converges to others.

The residual F(z) = P(z) - z is multiplied by m(z), the product of 1 + 1 / |(z - z_k) / s_k|^2 over known points z_k.
The product m F has no zero at a known point; elsewhere it has the zeros of F (Farrell, Birkisson & Funke 2015).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

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
    >>> import numpy as np
    >>> deflation = Deflation([KnownPoint(np.zeros(1), np.ones(1))])
    >>> deflation.factor(np.array([0.5])), deflation.step_ratio(np.array([1.0]), np.array([0.5]))
    (5.0, 0.6666666666666666)
    """

    def __init__(self, points: Sequence[KnownPoint] = ()) -> None:
        # Numbers of Python are three times as fast as arrays of this size.
        self._points = [(known.z.tolist(), known.scale.tolist()) for known in points]

    def factor(self, z: Array) -> float:
        """Return m(z), which is infinite at a known point."""
        factor, entries = 1.0, z.tolist()
        for centre, scale in self._points:
            offset = [(entry - c) / s for entry, c, s in zip(entries, centre, scale, strict=True)]
            square = sum([entry * entry for entry in offset])
            factor *= 1 + 1 / square if square else math.inf
        return factor

    def step_ratio(self, z: Array, direction: Array) -> float:
        """Return the ratio of the Newton step of m F to the Newton step d of F, which are parallel.

        It is 1 / (1 - grad m . d / m), which is negative if the deflated step leads away from a known point.
        """
        slope, entries, steps = 0.0, z.tolist(), direction.tolist()
        for centre, scale in self._points:
            offset = [(entry - c) / s for entry, c, s in zip(entries, centre, scale, strict=True)]
            square = sum([entry * entry for entry in offset])
            change = sum([entry * step / s for entry, step, s in zip(offset, steps, scale, strict=True)])
            slope -= 2 * change / (square * (square + 1)) if square else 0.0
        denominator = 1 - slope
        return 1 / math.copysign(max(abs(denominator), MIN_DENOMINATOR), denominator)
