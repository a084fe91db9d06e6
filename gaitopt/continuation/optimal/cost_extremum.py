"""Values of the parameter at which the optimal cost is stationary."""

from collections.abc import Callable

import scipy  # which imports its parts when they are used

from gaitopt.continuation.optimal.kkt_correction import at_value, correct
from gaitopt.continuation.optimal.kkt_point import KktLinearisation

FLAT = 1e-9
"""Change of the cost over the range of the parameter, relative to its typical size, that is due to rounding errors."""

TOLERANCE = 4e-16
"""Relative tolerance of a located value."""


def has_flat_cost(optimum: KktLinearisation) -> bool:
    """Return whether the optimal cost does not depend on the parameter, within rounding errors."""
    return abs(optimum.cost_slope) < FLAT * optimum.nlp.transcription.nlp.typical / optimum.nlp.width


def locate_cost_extremum(one: KktLinearisation, other: KktLinearisation) -> KktLinearisation | None:
    """Return the optimum between two points at which the derivative of the cost is zero; None if none exists.

    Parameters
    ----------
    one, other : KktLinearisation
        Points of one piece of a branch; the active set is that of the second.
    """
    ends = (one.point.value, other.point.value)
    if one.cost_slope * other.cost_slope > 0 or ends[0] == ends[1]:
        return None
    value = find_zero(lambda at: _cost_slope_at(other, at), *ends)
    return None if value is None else move_along(other, value)


def move_along(optimum: KktLinearisation, value: float) -> KktLinearisation | None:
    """Return the optimum of the piece of a branch, whose active set is kept, at a value of the parameter."""
    if value == optimum.point.value:
        return optimum
    step = value - optimum.point.value
    return correct(optimum.nlp, optimum.move(step * optimum.by_parameter, value), optimum.active, at_value(value))


def _cost_slope_at(optimum: KktLinearisation, value: float) -> float:
    moved = move_along(optimum, value)
    return float("nan") if moved is None else moved.cost_slope


def find_zero(function: Callable[[float], float], one: float, other: float) -> float | None:
    """Return the zero of a function between two values of different sign; None if it is not found.

    Parameters
    ----------
    function : callable
    one, other : float
        Ends of the interval.
    """
    first, last = function(one), function(other)
    if not first * last <= 0:
        return None
    try:
        return float(scipy.optimize.brentq(function, one, other, xtol=1e-300, rtol=4 * TOLERANCE))
    except (RuntimeError, ValueError):
        return None
