"""Curves of coordinates between their samples, which a simulation places at the steps of its integrator."""

import numpy as np

from gaitopt.motion.motion import Array

COARSE, POINTS = 30, 8
"""Number of samples of a phase below which points are added, and number of points between two samples."""


def interpolate_samples(time: Array, values: Array, rates: Array) -> tuple[Array, Array]:
    """Return instants and values with points added between few samples, on cubic polynomials with the given rates.

    Parameters
    ----------
    time, values, rates : (K,) arrays
        The samples are returned as they are if they are many, or if rates are not finite.

    Examples
    --------
    >>> time = np.array([0.0, 1.0, 3.0])
    >>> instants, fall = interpolate_samples(time, -(time**2), -2 * time)
    >>> instants.size, float(np.abs(fall + instants**2).max()) < 1e-12
    (17, True)
    """
    if not 1 < time.size < COARSE or not np.all(np.isfinite(rates)) or not np.all(np.diff(time) > 0):
        return time, values
    part = np.arange(POINTS) / POINTS
    step, rise = np.diff(time)[:, None], np.diff(values)[:, None]
    begin, end = step * rates[:-1, None] - rise, rise - step * rates[1:, None]
    inner = values[:-1, None] + part * rise + part * (1 - part) * ((1 - part) * begin + part * end)
    instants = time[:-1, None] + part * step
    return np.append(instants.ravel(), time[-1]), np.append(inner.ravel(), values[-1])
