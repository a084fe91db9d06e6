"""Axes of grids as they are written on the command line."""

import math
from collections.abc import Sequence

import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.motion import Array


def grid(over: Sequence[str], most: int) -> dict[str, Array]:
    """Return the values of axes by their names, each written ``NAME=FROM:TO:COUNT`` or ``NAME=VALUE,VALUE,...``.

    Raises
    ------
    InputError
        If one is not written so or cannot be, is named twice, or the grid has more than `most` points.

    Examples
    --------
    >>> grid(["friction=0.1:0.3:3", "speed=0.5"], 10)
    {'friction': array([0.1, 0.2, 0.3]), 'speed': array([0.5])}
    """
    read = [_read(text) for text in over]
    size = math.prod(count for _, _, count in read)
    if size > most:
        raise InputError(f"--over asks for {size} points, more than the {most} of the largest grid; take fewer.")
    axes = {
        name: np.array(ends) if count == len(ends) else np.linspace(ends[0], ends[-1], count)
        for name, ends, count in read
    }
    if len(axes) < len(over):
        raise InputError("--over names the same axis twice.")
    return axes


def _read(text: str) -> tuple[str, list[float], int]:
    """Return name, values and their number of an axis; of a range the ends."""
    name, equals, values = text.partition("=")
    ends, colon, count = values.rpartition(":") if ":" in values else (values, "", "")
    try:
        numbers = [float(value) for value in ends.split(":" if colon else ",")]
        number = int(count) if colon else len(numbers)
        if not equals or not name.strip() or number < 1 or (colon and len(numbers) != 2):
            raise ValueError
    except ValueError:
        raise InputError(f"An axis is written NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,..., got {text!r}.") from None
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"An axis needs finite values, got {text!r}.")
    return name.strip(), numbers[:number], number
