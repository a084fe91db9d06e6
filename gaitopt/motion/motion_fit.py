"""Fit of recorded samples by smooth curves, and its report."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array

FEW, PIECES = 12, 16
"""Largest number of samples through which a monotone curve is drawn, and default number of pieces of other splines."""

MOST_COLUMNS = 8
"""Number of unused columns that a report lists."""


@dataclass(frozen=True)
class CoordinateFit:
    """Fit of a coordinate, in its unit.

    Attributes
    ----------
    name, unit : str
    rms, largest : float
        Root mean square and largest absolute difference of the curve from the samples.
    place : float
        Fraction of the step at which the difference is largest.
    closure : float
        Difference of the end of the step after the leg exchange from its start; 0 for a periodic gait.
    rate_error : float
        Largest difference of the slope of the curve from the recorded rate; nan without one.

    Examples
    --------
    >>> one = CoordinateFit("th1", "rad", 1e-4, 3e-4, 0.9, closure=0.0, rate_error=float("nan"))
    >>> one.largest
    0.0003
    """

    name: str
    unit: str
    rms: float
    largest: float
    place: float
    closure: float
    rate_error: float


@dataclass(frozen=True)
class MotionFit:
    """Report on the fit of a recorded motion.

    Attributes
    ----------
    coordinates : tuple of CoordinateFit
    samples : int
    duration : float [s]
    landing_height : float
        Height of the landing foot over the ground at the end [m]; nan for a robot with several contacts.
    ignored : tuple of str
        Columns of the file that were not used.
    warnings : tuple of str

    Examples
    --------
    >>> from gaitopt import compass_biped, load, write_csv
    >>> from gaitopt.motion import read_motion
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_csv(load("docs/examples/compass_slip.h5").motion, f"{folder}/gait.csv")
    ...     fit = read_motion(path, compass_biped()).fit
    >>> fit.samples, max(one.largest for one in fit.coordinates) < 1e-3
    (101, True)
    """

    coordinates: tuple[CoordinateFit, ...]
    samples: int
    duration: float
    landing_height: float
    ignored: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [
            f"{self.samples} samples, {self.duration:.4g} s",
            "rms, largest: difference of the curve from the samples; at: part of the step after which it is largest; "
            "closure: difference of the end of the step, after the leg exchange, from its start",
            f"{'coordinate':20s} {'rms':>10} {'largest':>10} {'at [%]':>6} {'closure':>10} {'rate error':>11}",
        ]
        for one in self.coordinates:
            rate = "" if math.isnan(one.rate_error) else f"{one.rate_error:11.3g}"
            lines.append(
                f"{f'{one.name} [{one.unit}]':20s} {one.rms:10.2e} {one.largest:10.2e} {100 * one.place:6.0f} "
                f"{one.closure:10.2e} {rate}".rstrip()
            )
        if not math.isnan(self.landing_height):
            lines.append(f"height of the landing foot at the end: {self.landing_height:.3g} m")
        if self.ignored:
            lines.append(f"columns that were not used: {_list_columns(self.ignored)}")
            if any(name.endswith("_torque_Nm") for name in self.ignored):
                lines.append(
                    "If a gait file (.h5) of this motion exists, use it: its torques and multipliers count too."
                )
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])


def _list_columns(names: Sequence[str]) -> str:
    """Return the first names of many."""
    further = f" and {len(names) - MOST_COLUMNS} more" if len(names) > MOST_COLUMNS else ""
    return ", ".join(names[:MOST_COLUMNS]) + further


def fit_curve(time: Array, values: Array, pieces: int | None) -> Any:
    """Return a curve through samples as a callable (time, order of derivative) -> values.

    Few samples are interpolated by a monotone cubic, many are approximated by a cubic least-squares spline.

    Parameters
    ----------
    time : (K,) array [s]
        Increasing.
    values : (K,) array
    pieces : int or None
        Number of pieces of equal length of the spline.
    """
    from scipy.interpolate import PchipInterpolator, make_lsq_spline  # whose import takes longer than a solve

    if pieces is None and time.size <= FEW:
        return PchipInterpolator(time, values)
    count = min(PIECES, time.size // 4) if pieces is None else pieces
    inner = np.linspace(time[0], time[-1], count + 1)[1:-1]
    knots = np.concatenate([np.repeat(time[0], 4), inner, np.repeat(time[-1], 4)])
    try:
        return make_lsq_spline(time, values, knots)
    except ValueError:
        raise InputError(
            f"the number of pieces must be so small that every piece contains samples, got {count} for {time.size} "
            "samples."
        ) from None
