"""Derivative of the residual of a return map with respect to the parameter, from differences."""

import numpy as np

from gaitopt.continuation.map_family import MapFamily, MapSample
from gaitopt.motion.motion import Array

SENSITIVE = 100.0
"""Entry of the derivative with respect to the state above which the step is reduced in proportion, since the curvature
of the return map grows with this entry."""


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
    h = step * family.value_scale / max(1.0, float(np.max(np.abs(by_z))) / SENSITIVE)
    ends, sides = list[Array](), 0
    for sign in (1, -1):
        side = family.evaluate(z, value + sign * h)
        beside = side.residual is not None and side.structure == sample.structure
        sides += beside
        ends.append(np.asarray(side.residual if beside else sample.residual))
    return np.asarray((ends[0] - ends[1]) / (h * sides)) if sides else np.full(z.size, np.nan)
