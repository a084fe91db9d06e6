"""Fixed points of return maps by Newton's method with exact derivatives.

A damped step is accepted if it reduces the residual F(z) = P(z) - z sufficiently.  A return map amplifies some
deviations much more than others, so that the residual may grow on the way to a fixed point.  The search for gaits
therefore also accepts a step that reduces the Newton correction F'(z)^-1 F with the derivative at the last iterate,
which does not depend on the scaling of F (natural monotonicity test, Deuflhard 2011).
"""

import itertools

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst
from gaitopt.stability.deflation import Deflation
from gaitopt.stability.return_map import Passage, ReturnMap

RESIDUAL_FLOOR = 1e-15
"""Residual below which the iteration ends."""
SHRINKING = 0.9
"""An iteration shrinks to zero if it reduces the residual to less than this fraction, but the ratio of the residual to
the point to more than this fraction."""

STAGNATION = 3
"""Number of iterations without a new minimum of the residual or of the Newton correction that stagnate.  At this number
the search abandons 2 % of the iterations that would find a gait and saves 6 % of the time of all others."""


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
    accept_zero : bool
        Whether z = 0 is an accepted fixed point; otherwise an iteration that shrinks to it ends early.
    compare_corrections : bool
        Whether a step is also accepted if it reduces the Newton correction instead of the residual.  The iteration then
        ends early if it stagnates.
    """

    tolerance: float = 1e-11
    max_iterations: int = 25
    smallest_step: float = 1 / 64
    reduction: float = 2
    accept_zero: bool = True
    compare_corrections: bool = False


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
    gap, identity, history, measures = passage.end - z, np.eye(z.size), [], []
    for iteration in range(options.max_iterations + 1):
        error = worst(np.abs(gap))
        history.append((error, float(np.abs(z).max())))
        if not options.accept_zero and _shrinks_to_zero(history[-3:]):
            return None
        matrix = return_map.derivative(z, passage)
        if not np.isfinite(matrix).all():
            return None
        last = iteration == options.max_iterations or error <= RESIDUAL_FLOOR
        try:
            direction: Array = np.asarray(np.linalg.solve(identity - matrix, gap), dtype=float)
        except np.linalg.LinAlgError:
            return None
        measures.append((error, worst(np.abs(direction))))
        if options.compare_corrections and _stagnates(measures):
            return None
        step = direction * deflation.step_ratio(z, direction)
        progress = _Progress(z, gap, identity - matrix, direction, deflation, options)
        improved = None if last else _line_search(return_map, z, step, progress, options)
        if improved is None:
            converged = (
                bool(np.all(np.isfinite(direction))) and min(error, worst(np.abs(direction))) <= options.tolerance
            )
            return FixedPoint(z, matrix, error, passage, iteration) if converged else None
        z, passage, gap = improved
    return None


def _shrinks_to_zero(history: list[tuple[float, float]]) -> bool:
    """Return whether the last two iterations, three pairs of a residual and the largest entry of z, shrink to z = 0.

    Near z = 0 both are reduced by the same factor; near another fixed point the residual is reduced much faster.
    """
    return len(history) == 3 and all(
        SHRINKING * error > reduced and reduced * size > SHRINKING * error * smaller
        for (error, size), (reduced, smaller) in itertools.pairwise(history)
    )


def _stagnates(measures: list[tuple[float, float]]) -> bool:
    """Return whether neither the residual nor the Newton correction has reached a new minimum for some iterations."""
    former, recent = measures[:-STAGNATION], measures[-STAGNATION:]
    return bool(former) and all(min(new[k] for new in recent) >= min(old[k] for old in former) for k in (0, 1))


class _Progress:
    """Tests whether a trial point is closer to a fixed point than an iterate z.

    Parameters
    ----------
    z, gap : (n_z,) arrays
        Iterate and its residual.
    jacobian : (n_z, n_z) array
        1 - DP at the iterate.
    correction : (n_z,) array
        Newton step without deflation.
    deflation : Deflation
    options : FixedPointOptions

    Attributes
    ----------
    fine : bool
        Whether the residual is within the tolerance.
    """

    def __init__(
        self,
        z: Array,
        gap: Array,
        jacobian: Array,
        correction: Array,
        deflation: Deflation,
        options: FixedPointOptions,
    ) -> None:
        error, factor = np.abs(gap).max(), deflation.factor(z)
        self.fine = bool(error <= options.tolerance)
        self._residual, self._correction = factor * error, factor * np.abs(correction).max()
        self._jacobian, self._deflation = jacobian, deflation
        self._compares_corrections = options.compare_corrections and not self.fine

    def accepts(self, trial: Array, gap: Array, step: float) -> bool:
        """Return whether a trial point with a residual, reached with a damping, is an improvement."""
        factor, ratio = self._deflation.factor(trial), 1 - step / 4
        if factor * np.abs(gap).max() < ratio * self._residual:
            return True
        if not self._compares_corrections:
            return False
        return bool(factor * np.abs(np.linalg.solve(self._jacobian, gap)).max() < ratio * self._correction)


def _line_search(
    return_map: ReturnMap, z: Array, direction: Array, progress: _Progress, options: FixedPointOptions
) -> tuple[Array, Passage, Array] | None:
    """Return the first damped step that is an improvement, or None if no step is."""
    step = 1.0
    while step >= options.smallest_step:
        trial = z + step * direction
        if np.abs(trial).max() < 1e3:  # false for nan
            passage = return_map(trial)
            if passage.end is not None:
                gap = passage.end - trial
                if progress.accepts(trial, gap, step):
                    return trial, passage, gap
        if progress.fine:
            return None
        step /= options.reduction
    return None
