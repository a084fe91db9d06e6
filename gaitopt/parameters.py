"""Named real parameters with units and bounds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gaitopt.errors import InputError, suggest

__all__ = ["Parameter"]


@dataclass(frozen=True)
class Parameter:
    """A named real number with a unit and the interval it may lie in.

    Attributes
    ----------
    name : str
        Identifier, the same in Python, files and on the command line.
    default : float
        Value used when none is given, in `unit`.
    unit : str
        Unit, ``"1"`` for a pure number.
    lower, upper : float
        Bounds; `lower` is excluded when `lower_open`.
    infinite, whole : bool
        Whether an infinite value is allowed, and whether only whole numbers are.
    at_most : str
        Another parameter of the same robot that this one may not exceed; none if empty.
    description : str
        One line for people.

    Examples
    --------
    >>> Parameter("leg_mass", 4.0, "kg", "mass of a leg", lower=0, lower_open=True).default
    4.0
    """

    name: str
    default: float
    unit: str
    description: str
    lower: float = -math.inf
    upper: float = math.inf
    lower_open: bool = False
    infinite: bool = False
    whole: bool = False
    at_most: str = ""

    def check(self, value: object) -> float:
        """Return `value` as a float, or raise :class:`InputError` saying why it cannot be one.

        Examples
        --------
        >>> Parameter("leg_mass", 4.0, "kg", "mass of a leg", lower=0, lower_open=True).check(5)
        5.0
        """
        try:
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"{self.name} must be a number{self._unit()}, got {value!r}.") from None
        if math.isnan(number) or (math.isinf(number) and not self.infinite):
            raise InputError(f"{self.name} must be a finite number{self._unit()}, got {number}.")
        if self.whole and number != int(number):
            raise InputError(f"{self.name} must be a whole number{self._unit()}, got {value!r}.")
        low = number <= self.lower if self.lower_open else number < self.lower
        if low or number > self.upper:
            raise InputError(f"{self.name} must be {self._interval()}{self._unit()}, got {number:g}.")
        return number

    def _unit(self) -> str:
        return "" if self.unit == "1" else f" [{self.unit}]"

    def _interval(self) -> str:
        below = f"{'greater than' if self.lower_open else 'at least'} {self.lower:g}"
        above = f"at most {self.upper:g}"
        if math.isinf(self.upper):
            return below
        return above if math.isinf(self.lower) else f"{below} and {above}"


def resolve(parameters: tuple[Parameter, ...], values: Mapping[str, object], owner: str) -> dict[str, float]:
    """Fill in defaults and check every value.

    Parameters
    ----------
    parameters : tuple of Parameter
        What is known, in order.
    values : mapping
        What the user gave, by name.
    owner : str
        Whose parameters these are, for the error message.

    Returns
    -------
    dict
        Every parameter in the order of `parameters`.

    Raises
    ------
    InputError
        If a name is unknown or a value lies outside its bounds, another parameter's value among them.

    Examples
    --------
    >>> resolve((Parameter("gravity", 9.8, "m/s^2", "gravity"),), {}, "robot")
    {'gravity': 9.8}
    """
    names = [parameter.name for parameter in parameters]
    for name in values:
        if name not in names:
            raise InputError(f"{owner} has no parameter {name!r}. {suggest(name, names)}")
    found = {p.name: p.check(values.get(p.name, p.default)) for p in parameters}
    for p in parameters:
        if p.at_most and found[p.name] > found[p.at_most]:
            default = "" if p.name in values else ", its default"
            raise InputError(
                f"{p.name} ({p.description}) must be at most {p.at_most} = {found[p.at_most]:g}{p._unit()}, "
                f"got {found[p.name]:g}{default}."
            )
    return found


def check_options(options: object, *known: Parameter) -> None:
    """Check attributes of an object of options; the message names its class, too.

    Raises
    ------
    InputError
        If a value cannot be.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> check_options(SimpleNamespace(steps=3), counted("steps"))
    """
    for parameter in known:
        named = replace(parameter, name=f"{type(options).__name__}.{parameter.name}")
        named.check(getattr(options, parameter.name))


def counted(name: str, lower: int = 1) -> Parameter:
    """Return a parameter that is a whole number."""
    return Parameter(name, lower, "1", "", lower=lower, whole=True)


def positive(name: str, unit: str = "1", upper: float = math.inf) -> Parameter:
    """Return a parameter that is greater than 0."""
    return Parameter(name, 1.0, unit, "", lower=0.0, upper=upper, lower_open=True)


def as_vector(parameters: tuple[Parameter, ...], values: Mapping[str, float]) -> np.ndarray:
    """Return the values as a vector in the order of `parameters`, shape ``(n,)``; InputError if one is missing."""
    missing = [p.name for p in parameters if p.name not in values]
    if missing:
        raise InputError(f"There is no value of the robot's parameter {missing[0]!r}. Known: {', '.join(values)}.")
    return np.array([values[p.name] for p in parameters], dtype=float)
