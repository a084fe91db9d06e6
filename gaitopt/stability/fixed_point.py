"""Fixed points of return maps by Newton's method with exact derivatives."""

from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.reductions import worst
from gaitopt.stability.deflation import Deflation
from gaitopt.stability.return_map import Passage, ReturnMap

RESIDUAL_FLOOR = 1e-15
"""Residual below which the iteration ends."""


@dataclass(frozen=True, kw_only=True)
class FixedPointOptions:
    """Damped Newton iteration z <- z + s (P(z) - z) / (1 - DP).

    Attributes
    ----------
    tolerance : float
        Largest entry of P(z) - z, or of the corresponding error of z, that is accepted; the iteration continues while
        it improves.  The error of z is smaller if the map amplifies deviations, and with them rounding errors.
    max_iterations : int
    smallest_step : float
        Smallest damping s tried.
    reduction : float
        Ratio of a damping s to the next smaller one tried.
    """

    tolerance: float = 1e-11
    max_iterations: int = 25
    smallest_step: float = 1 / 64
    reduction: float = 2


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """A fixed point of a return map.

    Attributes
    ----------
    z : (n_z,) array
    derivative : (n_z, n_z) array
        Derivative of the return map.
    residual : float
        Largest entry of P(z) - z.
    passage : Passage
        The steps from z.
    iterations : int
    """

    z: Array
    derivative: Array
    residual: float
    passage: Passage
    iterations: int


def find_fixed_point(
    return_map: ReturnMap,
    z: Array,
    options: FixedPointOptions | None = None,
    *,
    deflation: Deflation | None = None,
    passage: Passage | None = None,
) -> FixedPoint | None:
    """Return the fixed point to which Newton's method converges from a start, or None if it does not converge.

    Parameters
    ----------
    return_map : ReturnMap
    z : (n_z,) array
        Start.
    options : FixedPointOptions, optional
    deflation : Deflation, optional
        Known fixed points, to which the iteration does not converge.
    passage : Passage, optional
        The steps from the start, if they have already been simulated.
    """
    options, deflation = options or FixedPointOptions(), deflation or Deflation()
    z = np.array(z, dtype=float)
    passage = passage or return_map(z)
    if passage.end is None:
        return None
    gap, identity = passage.end - z, np.eye(z.size)
    for iteration in range(options.max_iterations + 1):
        matrix, error = return_map.derivative(z, passage), worst(np.abs(gap))
        if not np.all(np.isfinite(matrix)):
            return None
        last = iteration == options.max_iterations or error <= RESIDUAL_FLOOR
        try:
            direction: Array = np.asarray(np.linalg.solve(identity - matrix, gap), dtype=float)
        except np.linalg.LinAlgError:
            return None
        step = direction * deflation.step_ratio(z, direction)
        improved = None if last else _line_search(return_map, z, step, error, options, deflation)
        if improved is None:
            converged = (
                bool(np.all(np.isfinite(direction))) and min(error, worst(np.abs(direction))) <= options.tolerance
            )
            return FixedPoint(z, matrix, error, passage, iteration) if converged else None
        z, passage, gap = improved
    return None


def _line_search(
    return_map: ReturnMap,
    z: Array,
    direction: Array,
    error: float,
    options: FixedPointOptions,
    deflation: Deflation,
) -> tuple[Array, Passage, Array] | None:
    """Return the first damped step that reduces the deflated residual, or None if no step does."""
    step, merit = 1.0, deflation.factor(z) * error
    while step >= options.smallest_step:
        trial = z + step * direction
        if np.all(np.isfinite(trial)) and np.max(np.abs(trial)) < 1e3:
            passage = return_map(trial)
            if passage.end is not None:
                gap = passage.end - trial
                if deflation.factor(trial) * np.max(np.abs(gap)) < (1 - step / 4) * merit:
                    return trial, passage, gap
        if error <= options.tolerance:
            return None
        step /= options.reduction
    return None
