"""Tracking of a motion as an objective."""

import hashlib
from dataclasses import field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.motion.motion import Array, Motion
from gaitopt.ocp.statement.instant import Instant
from gaitopt.ocp.statement.objective import Objective

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline
from gaitopt.ocp.statement.objective_value import first_step, is_finite
from gaitopt.parameters import Parameter

KNOTS = 33
"""Number of instants at which a cubic spline interpolates the reference."""


@check_arguments
@dataclass(frozen=True)
class Tracking(Objective):
    """Integral of the squared deviation of the angles and their rates from those of a motion [rad^2 s].

    Instants are matched by their fraction of the step, so the two steps may differ in duration and contact sequence.

    Attributes
    ----------
    motion : Motion
        Motion whose first step is the reference.
    rate_weight : float [s^2]
        Weight of the squared deviation of the rates.

    Raises
    ------
    InputError
        If the first step of the motion did not reach its touchdown, or the weight is negative.

    Examples
    --------
    >>> from gaitopt import load
    >>> Tracking(load("docs/examples/compass_slip.h5").motion).unit
    'rad^2 s'
    """

    motion: Motion = field(repr=False, compare=False)
    rate_weight: float = 0.01
    digest: str = field(default="", init=False)

    name = "tracking"
    unit = "rad^2 s"
    smooth = True
    typical = 0.01

    def __post_init__(self) -> None:
        if not isinstance(self.motion, Motion):
            raise InputError(f"Tracking needs a Motion such as gait.motion, got {type(self.motion).__name__}.")
        weight = Parameter("Tracking.rate_weight", 0.01, "s^2", "", lower=0.0).check(self.rate_weight)
        spline = interpolate_reference(self.motion)
        object.__setattr__(self, "rate_weight", weight)
        object.__setattr__(self, "_spline", spline)
        object.__setattr__(self, "digest", hashlib.sha256(spline.c.tobytes()).hexdigest()[:12])

    def integrand(self, point: Instant) -> Any:
        """Return the squared deviation [rad^2]."""
        if point.angles != self.motion.angles:
            raise InputError(
                f"The motion to track must have the angles of the robot, {point.angles}, got {self.motion.angles}."
            )
        spline: CubicSpline = self._spline  # type: ignore[attr-defined]
        target = _evaluate(spline, point.time)
        n = len(point.angles)
        rates = self.rate_weight * ca.sumsqr(point.v[ANGLES] - target[n:])
        return ca.sumsqr(point.q[ANGLES] - target[:n]) + rates

    def evaluate(self, motion: Motion) -> float:
        """Return the integral along the first step of a motion, the reference interpolated by SciPy."""
        from scipy.interpolate import CubicSpline  # whose import takes longer than a solve

        segments, _ = first_step(motion)
        if not is_finite(segments):
            return float("nan")
        begin, end = segments[0].time[0], segments[-1].time[-1]
        spline: CubicSpline = self._spline  # type: ignore[attr-defined]
        total = 0.0
        for segment in segments:
            target = spline((segment.time - begin) / (end - begin)).T
            angles, rates = np.split(np.vstack([segment.q[ANGLES], segment.v[ANGLES]]) - target, 2)
            values = np.sum(angles**2, axis=0) + self.rate_weight * np.sum(rates**2, axis=0)
            total += float(CubicSpline(segment.time, values).integrate(*segment.time[[0, -1]]))
        return total


def interpolate_reference(motion: Motion) -> "CubicSpline":
    """Return the angles and rates of the first step of a motion over the fraction of the step, 2 n_angles columns."""
    from scipy.interpolate import CubicSpline

    segments, _ = first_step(motion)
    if not is_finite(segments):
        raise InputError("The motion to track must be finite, got nan or inf.")
    begin, end = segments[0].time[0], segments[-1].time[-1]
    at = np.linspace(0.0, 1.0, KNOTS)
    ends = np.array([segment.time[-1] for segment in segments])
    owner = np.minimum(np.searchsorted(ends, begin + at * (end - begin)), len(segments) - 1)
    values = np.empty((KNOTS, 2 * len(motion.angles)))
    for k, segment in enumerate(segments[number] for number in owner):
        values[k] = _state(segment.time, segment.q[ANGLES], segment.v[ANGLES], begin + at[k] * (end - begin))
    return CubicSpline(at, values)


def _state(time: Array, angles: Array, rates: Array, at: float) -> Array:
    """Return angles and rates between samples."""
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline(time, angles, rates, axis=1)
    inside = np.clip(at, time[0], time[-1])
    return np.concatenate([curve(inside), curve(inside, 1)])


def _evaluate(spline: "CubicSpline", s: Any) -> Any:
    """Return a cubic spline at a symbol by truncated powers: no branches, two continuous derivatives."""
    cubic = spline.c[0]
    powers = [1.0, s, s**2, s**3]
    value = sum(ca.DM(spline.c[3 - k][0]) * powers[k] for k in range(4))
    for knot, change in zip(spline.x[1:-1], np.diff(cubic, axis=0), strict=True):
        if np.any(change):
            value += ca.DM(change) * ca.fmax(s - float(knot), 0) ** 3
    return value
