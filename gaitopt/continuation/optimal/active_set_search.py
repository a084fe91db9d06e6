"""Optima of a parametric NLP with their active constraints, found by a solve from a point nearby."""

from collections.abc import Sequence

import numpy as np

from gaitopt.continuation.optimal.kkt_correction import at_value, correct
from gaitopt.continuation.optimal.kkt_point import ActiveSet, KktLinearisation, KktPoint
from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.progress import silent
from gaitopt.status import Status

MOST_ADJUSTMENTS = 10
"""Largest number of changes of the active set at the start."""

NONZERO = 1e-10
"""Scaled multiplier above which a constraint is active."""

DISTANCES = (1e-3, 1e-4, 5e-3)
"""Distances beyond a change at which the optimum is sought, relative to the range of the parameter."""

CONTINUOUS = 10.0
"""Largest scaled change of an unknown over such a distance, relative to the square root of the distance."""


def find_optimum(
    nlp: ParametricNlp, x: Array, multipliers: tuple[Array, Array], value: float
) -> KktLinearisation | None:
    """Return the optimum at a value of the parameter near some unknowns; None if its active set is not determined.

    An interrupt of the solve raises KeyboardInterrupt.

    Parameters
    ----------
    nlp : ParametricNlp
    x : (n_variables,) array
    multipliers : ((n_variables,) array, (n_rows,) array)
        Multipliers of bounds and rows at a point nearby.
    value : float
        Parameter.
    """

    def locate_data(x: Array) -> Array:
        return nlp.locate_sign_changes(x).data.at(value)

    limits, inner = nlp.bounds_at(value), nlp.transcription.nlp
    result = Newton().minimise(inner, x, locate_data(x), limits, silent, multipliers, update_data=locate_data)
    if result.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    nlp, scaled = nlp.locate_sign_changes(result.x), np.concatenate(result.multipliers) / inner.typical
    equal = (nlp.lower.origin == nlp.upper.origin) & (nlp.lower.slope == nlp.upper.slope)
    positions = np.concatenate([result.x, result.g])
    bound = np.where(scaled > 0, nlp.upper.at(value), nlp.lower.at(value))
    distances = np.abs(np.where(np.isfinite(bound), bound - positions, np.inf))
    signs = np.where(np.abs(scaled) > np.maximum(NONZERO, distances), np.sign(scaled), 0.0)
    active = ActiveSet(np.where(equal, 1, signs).astype(np.int8), equal, nlp.size)
    return _adjust_active_set(nlp, KktPoint(result.x, scaled[nlp.size :], value), active) if result.status.ok else None


def find_optimum_beyond(
    optimum: KktLinearisation, direction: float, limit: float, distances: Sequence[float] = DISTANCES
) -> KktLinearisation | None:
    """Return the optimum a short distance beyond a change of the active set, found by a solve; None if none exists.

    If the gradients of the active constraints are dependent, as over an interval without torque, several constraints
    change together.  Their multipliers are not unique and do not determine which constraints change.

    Parameters
    ----------
    optimum : KktLinearisation
        The point of the change.
    direction : float
        Sign of the change of the parameter.
    limit : float
        Bound of the parameter, which the search does not exceed.
    distances : sequence of float
        Distances at which the optimum is sought, relative to the range.
    """
    for distance in distances:
        value = optimum.point.value + direction * distance * optimum.nlp.width
        after = solve_nearby(
            optimum, limit if (value - limit) * direction > 0 else value, CONTINUOUS * np.sqrt(distance)
        )
        if after is not None:
            return after
    return None


def solve_nearby(optimum: KktLinearisation, value: float, largest: float) -> KktLinearisation | None:
    """Return the optimum at a value of the parameter by a solve from one nearby; None if its unknowns differ too much.

    Parameters
    ----------
    optimum : KktLinearisation
    value : float
    largest : float
        Largest scaled change of an unknown.
    """
    nlp, before = optimum.nlp, optimum.point
    typical = nlp.transcription.nlp.typical
    multipliers = optimum.bound_multipliers * typical, before.multipliers * typical
    after = find_optimum(nlp, before.x, multipliers, value)
    near = after is not None and np.max(np.abs(after.point.x - before.x) / nlp.sizes) <= largest
    return after if near else None


def _adjust_active_set(nlp: ParametricNlp, point: KktPoint, active: ActiveSet) -> KktLinearisation | None:
    """Return the optimum near a point; violated constraints and multipliers of the wrong sign switch."""
    for _ in range(MOST_ADJUSTMENTS):
        optimum = correct(nlp, point, active, at_value(point.value))
        if optimum is None or optimum.strictness >= -NONZERO:
            return optimum
        for index in np.flatnonzero(optimum.margins < -NONZERO).tolist():
            active = active.switch(index, 0 if active.sides[index] else optimum.nearest_side(index))
        point = optimum.point
    return None
