"""Newton's method and tangents on the curves of the optimality conditions.

One more equation selects a point of a curve: a value of the parameter, a distance along the tangent, or the zero of the
multiplier or of the slack of one constraint.
"""

import math
from collections.abc import Callable

import numpy as np
import scipy  # which imports its parts when they are used

from gaitopt.continuation.optimal.kkt_point import ActiveSet, KktLinearisation, KktPoint
from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst

MOST_ITERATIONS = 10
"""Largest number of Newton steps."""

SMALL_STEP = 1e-9
"""Scaled Newton step after which the iteration ends; the next one is below 1e-11."""

FAST = 0.05
"""Ratio of successive steps up to which the matrix of an earlier iteration is used."""

STEEP = 1e-3
"""Share of the parameter in the unit tangent below which the extended system is solved."""

LARGEST_RESIDUAL = 1e-9
"""Largest residual of the optimality conditions, scaled objective."""

LARGEST_STEP = 30.0
"""Scaled Newton step above which the iteration is abandoned."""


@dataclass(frozen=True, eq=False)
class CurveCondition:
    """The equation that selects a point of a curve.

    Attributes
    ----------
    residual : KktLinearisation -> float
    slopes : KktLinearisation -> ((k,) array, float)
        Derivatives of the residual with respect to the packed vector and the parameter.
    """

    residual: Callable[[KktLinearisation], float]
    slopes: Callable[[KktLinearisation], tuple[Array, float]]


def at_value(value: float) -> CurveCondition:
    """Return the condition that the parameter has a value."""
    return CurveCondition(
        residual=lambda linear: linear.point.value - value,
        slopes=lambda linear: (np.zeros(linear.active.count), 1.0),
    )


def at_zero_margin(index: int) -> CurveCondition:
    """Return the condition that the multiplier of an active constraint, or the slack of an inactive one, is zero."""
    return CurveCondition(
        residual=lambda linear: float(linear.margins[index]),
        slopes=lambda linear: linear.differentiate_margin(index),
    )


@dataclass(frozen=True, eq=False)
class Metric:
    """Weights of the squared length of a tangent: unknowns in their typical sizes, parameter relative to its range."""

    nlp: ParametricNlp

    def weigh(self, active: ActiveSet) -> tuple[Array, float]:
        """Return the weights of the packed vector and of the parameter."""
        weights = np.zeros(active.count)
        weights[: active.free.size] = self.nlp.sizes[active.free] ** -2.0 / self.nlp.size
        return weights, self.nlp.width**-2.0


def at_distance(metric: Metric, tangent: tuple[Array, float], predicted: KktPoint) -> CurveCondition:
    """Return the condition that a point lies in the plane through a predicted point, normal to the tangent."""

    def weigh_tangent(linear: KktLinearisation) -> tuple[Array, float]:
        weights, weight = metric.weigh(linear.active)
        return weights * tangent[0], weight * tangent[1]

    def residual(linear: KktLinearisation) -> float:
        row, last = weigh_tangent(linear)
        distance = linear.pack(linear.point.x - predicted.x, linear.point.multipliers - predicted.multipliers)
        return float(row @ distance + last * (linear.point.value - predicted.value))

    return CurveCondition(residual=residual, slopes=weigh_tangent)


def correct(
    nlp: ParametricNlp,
    start: KktPoint,
    active: ActiveSet,
    condition: CurveCondition,
    factorised: KktLinearisation | None = None,
) -> KktLinearisation | None:
    """Return the point of the curve of an active set that satisfies a condition; None if Newton's method fails.

    One matrix is used as long as the steps decrease fast.

    Parameters
    ----------
    nlp : ParametricNlp
    start : KktPoint
    active : ActiveSet
    condition : CurveCondition
    factorised : KktLinearisation, optional
        A nearby point of the same active set, whose matrix is used first.
    """
    sizes = np.concatenate([nlp.sizes[active.free], np.ones(active.rows.size)])
    linear, before = KktLinearisation(nlp, start, active), math.inf
    factorised = linear if factorised is None else factorised
    slopes = condition.slopes(factorised)
    for _ in range(MOST_ITERATIONS):
        change, step = _take_step(linear, factorised, *slopes, condition.residual(linear))
        scale = sizes + np.abs(linear.pack(linear.point.x, linear.point.multipliers))
        size = worst(np.abs(change) / scale, abs(step) / nlp.width)
        if not size < LARGEST_STEP:
            return None
        linear = KktLinearisation(nlp, linear.move(change, linear.point.value + step), active)
        if size < SMALL_STEP:
            return linear if worst(np.abs(linear.residual)) < LARGEST_RESIDUAL else None
        if size > FAST * before:
            factorised, slopes = linear, condition.slopes(linear)
        before = size
    return None


def _take_step(
    linear: KktLinearisation, factorised: KktLinearisation, row: Array, last: float, remainder: float
) -> tuple[Array, float]:
    """Return the Newton step of the packed vector and of the parameter; nan if the matrix is singular.

    Parameters
    ----------
    linear : KktLinearisation
        The point, whose residuals are reduced.
    factorised : KktLinearisation
        The point of the matrix.
    row, last, remainder : (k,) array, float, float
        Derivatives of the condition at the point of the matrix, and its residual.
    """
    if not np.any(row):  # the parameter is given
        step = -remainder / last
        residual = linear.residual + step * linear.column if step else linear.residual
        return -factorised.solve(residual), step
    along, nlp = factorised.by_parameter, linear.nlp
    count = linear.active.free.size
    steepness = worst(np.abs(along[:count]) / nlp.sizes[linear.active.free], 0.0) * nlp.width
    if steepness * STEEP < 1:  # far from a turning point the matrix itself is regular
        change = factorised.solve(linear.residual)
        step = (float(row @ change) - remainder) / (last + float(row @ along))
        return step * along - change, step
    return _solve_with_condition(factorised, row, last, -np.append(linear.residual, remainder))


def _solve_with_condition(linear: KktLinearisation, row: Array, last: float, right: Array) -> tuple[Array, float]:
    """Return the solution of the system extended by one equation, which is regular at turning points too."""
    matrix = scipy.sparse.bmat(
        [[linear.matrix, linear.column[:, None]], [row[None, :], np.array([[last]])]], format="csc"
    )
    try:
        solution = scipy.sparse.linalg.splu(matrix).solve(right)
    except RuntimeError:  # singular
        solution = np.full(right.size, np.nan)
    return solution[:-1], float(solution[-1])


def find_tangent(
    linear: KktLinearisation, metric: Metric, near: tuple[Array, float] | None = None
) -> tuple[Array, float]:
    """Return the unit tangent of the curve at a point: of the packed vector, and of the parameter.

    Parameters
    ----------
    linear : KktLinearisation
    metric : Metric
    near : (Array, float), optional
        Tangent of a nearby point of the same active set, whose direction is kept; otherwise towards larger values.
    """
    weights, weight = metric.weigh(linear.active)
    packed, last = linear.by_parameter, 1.0
    length = math.sqrt(float(weights @ packed**2) + weight)
    if near is not None and not math.sqrt(weight) > STEEP * length:
        right = np.append(np.zeros(packed.size), 1.0)
        packed, last = _solve_with_condition(linear, weights * near[0], weight * near[1], right)
        length = math.sqrt(float(weights @ packed**2) + weight * last**2)
    elif near is not None and float(weights @ (packed * near[0])) + weight * near[1] < 0:
        length = -length
    return packed / length, last / length
