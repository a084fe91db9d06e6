"""Optima at given values of the parameter between two points of one smooth piece of their curve.

Between two points with known tangents the curve is close to a cubic (Hermite) polynomial of the parameter.  Newton's
method corrects this guess with the matrix of the nearer point, which costs much less than a step of the continuation.
"""

import numpy as np

from gaitopt.continuation.optimal.kkt_correction import Metric, at_value, correct
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.motion.motion import Array

LARGEST_CORRECTION = 0.1
"""Distance of an optimum from its guess, relative to that of the two points, beyond which the guess is rejected."""

NEGLIGIBLE = 1e-8
"""Distance, relative to the typical unknowns, that is due to rounding errors."""


class PieceInterpolation:
    """Cubic interpolation of the optima between two points with the same active set.

    Parameters
    ----------
    one, other : KktLinearisation
        Points at different values of the parameter, between which it does not turn back.
    metric : Metric
    """

    def __init__(self, one: KktLinearisation, other: KktLinearisation, metric: Metric) -> None:
        self.one, self.other, self.width = one, other, other.point.value - one.point.value
        self.change = one.pack(other.point.x - one.point.x, other.point.multipliers - one.point.multipliers)
        self.slopes = one.by_parameter * self.width, other.by_parameter * self.width
        self._weights = metric.weigh(one.active)[0]

    def find_optimum(self, value: float) -> KktLinearisation | None:
        """Return the optimum at a value between the two points; None if Newton's method leads away from the curve.

        If the reduced Hessians at both points have the same number of negative eigenvalues, so has that in between,
        because it is not singular where the parameter does not turn back.
        """
        one, other = self.one, self.other
        nearer = one if abs(value - one.point.value) < abs(value - other.point.value) else other
        guess = one.move(self._interpolate((value - one.point.value) / self.width), value)
        optimum = correct(one.nlp, guess, one.active, at_value(value), nearer)
        if optimum is None or not self._is_near(one.pack(optimum.point.x - guess.x, 0 * guess.multipliers)):
            return None
        if one.negative == other.negative:
            optimum.negative = one.negative
        return optimum

    def _interpolate(self, share: float) -> Array:
        """Return the change of the packed vector from the first point."""
        first, last = self.slopes
        bend = share * (1 - share)
        return (
            share**2 * (3 - 2 * share) * self.change
            + bend * (1 - share) * np.asarray(first)
            - bend * share * np.asarray(last)
        )

    def _is_near(self, change: Array) -> bool:
        """Return whether a change of the unknowns is small compared with that between the two points."""
        lengths = [float(np.sqrt(self._weights @ vector**2)) for vector in (change, self.change)]
        return lengths[0] <= max(LARGEST_CORRECTION * lengths[1], NEGLIGIBLE)
