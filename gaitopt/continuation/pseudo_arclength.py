"""Pseudo-arclength continuation: initialise, predict, correct and adapt.

A branch of fixed points F(z, value) = 0 is a curve x(s) of x = (z / scale, value / value_scale).  The predictor follows
its tangent t by a step; the corrector solves F = 0 and t . (x - x_predicted) = 0 by Newton's method (Keller 1977).
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.continuation.checkpoint import Checkpoint, Correction
from gaitopt.continuation.map_family import MapFamily, MapSample
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.reductions import worst

FLOOR = 1e-13
"""Scaled residual below which Newton's method ends."""
NEARBY_ITERATIONS = 3
"""Iterations with the derivative with respect to the parameter of a point nearby, before it is computed."""
SLOW_CONVERGENCE = 0.05
"""Reduction of the residual in an iteration above which the derivative with respect to the parameter is computed again:
its error grows with the multipliers."""
LONGEST_NEWTON_STEP = 1.0
"""Scaled Newton step above which the correction is abandoned."""


@check_arguments
@frozen(kw_only=True)
class ArclengthOptions:
    """Options of pseudo-arclength continuation.  Lengths are relative to the natural size of the coordinates.

    Attributes
    ----------
    first_step, longest_step, shortest_step : float
        A branch ends if the corrector fails for the shortest step.
    tolerance : float
        Largest residual, or largest last Newton step, that is accepted.
    most_iterations : int
        Newton iterations in one correction.
    largest_angle : float [rad]
        Largest angle between the tangents of consecutive points of the same smooth piece.
    most_points : int
        Largest number of points of a branch.

    Examples
    --------
    >>> ArclengthOptions().largest_angle
    0.35
    """

    first_step: float = field(default=0.01, validator=positive())
    longest_step: float = field(default=0.03, validator=positive())
    shortest_step: float = field(default=1e-10, validator=positive())
    tolerance: float = field(default=1e-10, validator=positive())
    most_iterations: int = field(default=8, validator=whole_number())
    largest_angle: float = field(default=0.35, validator=positive())
    most_points: int = field(default=2000, validator=whole_number())


@dataclass(frozen=True, eq=False, kw_only=True)
class CurvePoint:
    """A point of a branch with its tangent.

    Attributes
    ----------
    z : (n,) array
    value : float
    sample : MapSample
    derivative : (n, n + 1) array
        Derivative of the residual with respect to (z, value).
    multipliers : (n_m,) complex array
    tangent : (n + 1,) array
        Unit tangent in scaled coordinates, in the direction of the continuation.
    orbit : (steps, n) array
        Points at the start of each step of the period, `z` first.
    iterations : int
        Newton iterations of the correction until the tolerance is reached; those that follow reduce the residual to
        its rounding errors, which grow with the multipliers.
    """

    z: Array
    value: float
    sample: MapSample
    derivative: Array
    multipliers: NDArray[np.complex128]
    tangent: Array
    orbit: Array
    iterations: int

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int(np.count_nonzero(np.abs(self.multipliers) > 1))


class Stepper:
    """Predictor and corrector along the branches of a family.

    Parameters
    ----------
    family : MapFamily
    options : ArclengthOptions
    checkpoint : Checkpoint, optional
        File of the corrections.
    """

    def __init__(self, family: MapFamily, options: ArclengthOptions, checkpoint: Checkpoint | None = None) -> None:
        self.family, self.options, self.checkpoint = family, options, checkpoint
        self.scales = np.append(family.scale, family.value_scale)

    def initialise(self, z: Array, value: float, direction: float) -> CurvePoint | None:
        """Return the branch point at a value near a start, with the tangent towards larger or smaller values.

        Parameters
        ----------
        z : (n,) array
        value : float
        direction : float
            Positive towards larger values.
        """
        towards = np.zeros(self.family.size + 1)
        towards[-1] = math.copysign(1.0, direction)
        return self.correct(np.append(z, value) / self.scales, towards)

    def predict(self, point: CurvePoint, step: float, bend: Array | float = 0.0) -> Array:
        """Return the scaled coordinates at a step along the tangent, shape (n + 1,).

        Parameters
        ----------
        point : CurvePoint
        step : float
        bend : (n + 1,) array, optional
            Rate of the tangent along the branch, see :meth:`bend`.
        """
        return self.position(point) + step * point.tangent + step**2 / 2 * np.asarray(bend)

    def bend(self, point: CurvePoint, following: CurvePoint) -> Array:
        """Return the rate of the tangent between two points of the same smooth piece, otherwise zero."""
        distance = float(np.linalg.norm(self.position(following) - self.position(point)))
        if point.sample.structure != following.sample.structure or not distance:
            return np.zeros(self.scales.size)
        return np.asarray((following.tangent - point.tangent) / distance)

    def position(self, point: CurvePoint) -> Array:
        """Return the scaled coordinates of a point, shape (n + 1,)."""
        return np.append(point.z, point.value) / self.scales

    def correct(
        self, guess: Array, normal: Array, by_value: Array | None = None, near: Sequence[CurvePoint] = ()
    ) -> CurvePoint | None:
        """Return the branch point in the plane through a guess with the given normal, or None without convergence.

        The tangent of the result makes an acute angle with the normal.

        Parameters
        ----------
        guess, normal : (n + 1,) arrays
            In scaled coordinates.
        by_value : (n,) array, optional
            Derivative of the residual with respect to the parameter at a point nearby, for the first iterations.
        near : sequence of CurvePoint
            Points so close that this derivative is the same at all points of their structure.
        """
        if self.checkpoint is None:
            return self._iterate(guess, normal, by_value, near)
        stored, correction = self.checkpoint.recall(guess, normal)
        if stored and correction is None:
            return None
        if correction is not None:
            return self._restore_point(correction)
        point = self._iterate(guess, normal, by_value, near)
        self.checkpoint.record(guess, normal, None if point is None else _correction_of(point))
        return point

    def _restore_point(self, correction: Correction) -> CurvePoint:
        """Return the point of a stored correction."""
        sample = self.family.evaluate(correction.z, correction.value)
        orbit = self.family.orbit(correction.z, correction.value, sample)
        return CurvePoint(sample=sample, orbit=orbit, **correction._asdict())

    def _iterate(
        self, guess: Array, normal: Array, by_value: Array | None, near: Sequence[CurvePoint]
    ) -> CurvePoint | None:
        """Return the point to which Newton's method converges, or None."""
        x, size = np.array(guess), self.family.size
        best, nearby, reached = math.inf, by_value is not None, None
        for iteration in range(self.options.most_iterations + 1):
            if nearby and iteration == NEARBY_ITERATIONS:
                by_value = None
            z, value = x[:size] * self.scales[:size], float(x[size] * self.scales[size])
            sample = self.family.evaluate(z, value)
            if sample.residual is None:
                return None
            derivative = self.family.derivative(z, value, sample, by_value)
            right = np.append(sample.residual / self.family.scale, normal @ (x - guess))
            step = _solve(self._border(derivative, normal), -right)
            error, length = worst(np.abs(right)), math.inf if step is None else worst(np.abs(step))
            if step is None or not length <= LONGEST_NEWTON_STEP:
                return None
            if min(error, length) <= self.options.tolerance:
                reached = iteration if reached is None else reached
                if error >= best / 4 or error <= FLOOR or iteration == self.options.most_iterations:
                    same = (point.derivative[:, -1] for point in near if point.sample.structure == sample.structure)
                    return self._make_point(z, value, sample, normal, reached, next(same, None))
            slow = math.isfinite(best) and error > SLOW_CONVERGENCE * best
            best, by_value, x = min(best, error), None if slow else derivative[:, -1], x + step
        return None

    def _make_point(
        self,
        z: Array,
        value: float,
        sample: MapSample,
        normal: Array,
        iterations: int,
        by_value: Array | None,
    ) -> CurvePoint | None:
        """Return a solution as a point of the branch, with its exact derivative; None if there is no tangent."""
        derivative = self.family.derivative(z, value, sample, by_value)
        tangent = _solve(self._border(derivative, normal), np.eye(self.family.size + 1)[-1])
        if tangent is None:
            return None
        return CurvePoint(
            z=z,
            value=value,
            sample=sample,
            derivative=derivative,
            multipliers=self.family.multipliers(derivative, sample),
            tangent=tangent / np.linalg.norm(tangent),
            orbit=self.family.orbit(z, value, sample),
            iterations=iterations,
        )

    def _border(self, derivative: Array, normal: Array) -> Array:
        """Return the scaled derivative with the normal as its last row."""
        return np.vstack([derivative * self.scales / self.family.scale[:, None], normal])

    def adapt(self, step: float, point: CurvePoint, following: CurvePoint) -> float:
        """Return the next step from the effort of the last correction and the turn of the tangent."""
        turn = self.angle(point, following) / self.options.largest_angle
        factor = 1.6 if following.iterations <= 4 and turn < 0.5 else 0.7 if turn > 0.8 else 1.0
        return min(step * factor, self.options.longest_step)

    def angle(self, point: CurvePoint, other: CurvePoint) -> float:
        """Return the angle between the tangents of two points [rad]."""
        return float(np.arccos(np.clip(point.tangent @ other.tangent, -1, 1)))


def _correction_of(point: CurvePoint) -> Correction:
    return Correction(point.z, point.value, point.derivative, point.multipliers, point.tangent, point.iterations)


def _solve(matrix: Array, right: Array) -> Array | None:
    """Return the solution of a linear system, or None if it is singular or not finite."""
    if not np.all(np.isfinite(matrix)):
        return None
    try:
        solution = np.asarray(np.linalg.solve(matrix, right), dtype=float)
    except np.linalg.LinAlgError:
        return None
    return solution if np.all(np.isfinite(solution)) else None
