"""Values given on the command line as NAME=VALUE."""

import ast
import math
from collections.abc import Mapping
from typing import Any

from gaitopt.errors import InputError, suggest
from gaitopt.model.terrain import Terrain

TARGETS = ("speed", "step_length")
"""Parameters that may also be bounds ``LOWER:UPPER`` or ``free``."""


def read_setting(text: str, defaults: Mapping[str, Any], script: str) -> tuple[str, Any]:
    """Return name and value of ``NAME=VALUE``, a change of a parameter of a script.

    Parameters
    ----------
    text : str
    defaults : mapping of str to object
        Parameters of the script with their defaults.
    script : str
        File name, for messages.

    Raises
    ------
    InputError
        If the text is not of this form, or the script has no such parameter, or the default is a number and the value
        is not.

    Examples
    --------
    >>> read_setting("speed=0.5:0.7", {"speed": 0.6}, "walk.py")
    ('speed', (0.5, 0.7))
    >>> read_setting("speed=free", {"speed": 0.6}, "walk.py")
    ('speed', None)
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not name:
        raise InputError(f"--set must have the form NAME=VALUE, got {text!r}.")
    if name not in defaults:
        raise InputError(f"{script} has no parameter {name!r}. {suggest(name, defaults)}")
    default = defaults[name]
    if isinstance(default, str):
        return name, value.strip("'\"")
    result = _target(value) if name in TARGETS else _literal(value)
    if isinstance(default, int | float) and not isinstance(result, int | float | tuple | list | dict | None):
        kind = "True or False" if isinstance(default, bool) else "a number"
        accepted = ", bounds LOWER:UPPER, or free" if name in TARGETS else ""
        raise InputError(f"--set {name}: {name} must be {kind} like its default {default!r}{accepted}, got {value!r}.")
    return name, result


def read_numbers(settings: list[str] | None, option: str) -> dict[str, float]:
    """Return NAME=NUMBER settings as a mapping.

    Raises
    ------
    InputError
        If one is not of this form.

    Examples
    --------
    >>> read_numbers(["damping=12"], "--gain")
    {'damping': 12.0}
    """
    values = {}
    for text in settings or []:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"{option} must have the form NAME=NUMBER, got {text!r}.") from None
    return values


def read_bounds(settings: list[str] | None, option: str) -> dict[str, tuple[float, float]]:
    """Return NAME=LOWER:UPPER settings as a mapping.

    Raises
    ------
    InputError
        If one is not of this form, or a lower bound is not below the upper one.

    Examples
    --------
    >>> read_bounds(["torque=0.5:60"], "--bound")
    {'torque': (0.5, 60.0)}
    """
    bounds = {}
    for text in settings or []:
        name, _, interval = text.partition("=")
        try:
            lower, upper = map(float, interval.split(":"))
        except ValueError:
            raise InputError(f"{option} must have the form NAME=LOWER:UPPER, got {text!r}.") from None
        if not -math.inf < lower < upper < math.inf:
            raise InputError(
                f"{option} {name.strip()}: the bounds must be finite, LOWER below UPPER, got {interval!r}."
            )
        bounds[name.strip()] = lower, upper
    return bounds


def read_terrain(rises: list[str] | None, patches: list[str] | None) -> Terrain | None:
    """Return the terrain of ``POSITION:HEIGHT`` steps and ``BEGIN:END:FRICTION`` patches, or None if there are none.

    Raises
    ------
    InputError
        If one is not of this form, or the terrain is invalid.

    Examples
    --------
    >>> read_terrain(["1.2:-0.02"], None)
    Terrain(steps=((1.2, -0.02),), patches=(), ramps=())
    """
    if not rises and not patches:
        return None
    steps = [_read_colons(text, "--rise", "POSITION:HEIGHT") for text in rises or []]
    bands = [_read_colons(text, "--patch", "BEGIN:END:FRICTION") for text in patches or []]
    return Terrain(steps=steps, patches=bands)


def _read_colons(text: str, option: str, form: str) -> Any:
    """Return numbers separated by colons."""
    parts = text.split(":")
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        numbers = ()
    if len(numbers) != len(form.split(":")):
        raise InputError(f"{option} must have the form {form}, lengths in m, got {text!r}.")
    return numbers


def _literal(text: str) -> Any:
    """Return a Python literal, a float such as inf, or the text itself."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        try:
            number = float(text)
        except ValueError:
            return text
        return number if math.isinf(number) or math.isnan(number) else text


def _target(text: str) -> Any:
    """Return a target: a number, bounds (lower, upper), or None if it is free."""
    if text.lower() == "free":
        return None
    lower, colon, upper = text.partition(":")
    if not colon:
        return _literal(text)
    try:
        return float(lower), float(upper)
    except ValueError:
        return text
