"""Derivative of the residual of a return map with respect to the parameter, from differences."""

import numpy as np

from gaitopt.continuation.map_family import MapFamily, MapSample
from gaitopt.motion.motion import Array

SENSITIVE = 100.0
"""Entry of the derivative with respect to the state above which the step is reduced in proportion, since the curvature
of the return map grows with this entry, and the differences over two steps are extrapolated to zero."""


def differentiate_by_value(
    family: MapFamily, z: Array, value: float, sample: MapSample, by_z: Array, step: float
) -> Array:
    """Return d residual / d value within the smooth piece of a sample, from differences on one or both sides, (n,).

    Parameters
    ----------
    family : MapFamily
    z : (n,) array
    value : float
    sample : MapSample
        The map at z and value.
    by_z : (n, n) array
        Derivative with respect to z.
    step : float
        Step of the differences for a map of low sensitivity, relative to the size of the parameter.
    """
    excess = float(np.max(np.abs(by_z))) / SENSITIVE
    h = step * family.value_scale / max(1.0, excess)
    slope, sides = _difference(family, z, value, sample, h)
    if excess <= 1 or sides < 2:
        return slope
    finer, sides = _difference(family, z, value, sample, h / 2)
    return (4 * finer - slope) / 3 if sides == 2 else slope


def _difference(family: MapFamily, z: Array, value: float, sample: MapSample, h: float) -> tuple[Array, int]:
    """Return the difference quotient over a step, nan without a side of the same structure, and the number of sides."""
    ends, sides = list[Array](), 0
    for sign in (1, -1):
        side = family.evaluate(z, value + sign * h)
        beside = side.residual is not None and side.structure == sample.structure
        sides += beside
        ends.append(np.asarray(side.residual if beside else sample.residual))
    return np.asarray((ends[0] - ends[1]) / (h * sides)) if sides else np.full(z.size, np.nan), sides
