"""Axes of grids as they are written on the command line."""

import math

import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.motion import Array


def grid(text: str) -> tuple[str, Array]:
    """Return name and values of an axis written ``NAME=FROM:TO:COUNT`` or ``NAME=VALUE,VALUE,...``.

    Raises
    ------
    InputError
        If it is not written so.

    Examples
    --------
    >>> grid("friction=0.1:0.3:3")
    ('friction', array([0.1, 0.2, 0.3]))
    """
    name, equals, values = text.partition("=")
    try:
        if not equals or not name.strip():
            raise ValueError
        if ":" in values:
            lower, upper, count = values.split(":")
            points = np.linspace(float(lower), float(upper), int(count))
        else:
            points = np.array([float(value) for value in values.split(",")])
        if points.size == 0 or not all(map(math.isfinite, points)):
            raise ValueError
    except ValueError:
        raise InputError(f"An axis is written NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,..., got {text!r}.") from None
    return name.strip(), points
