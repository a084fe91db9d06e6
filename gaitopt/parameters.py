"""Named real parameters with units and bounds."""

import functools
import math
from collections.abc import Callable, Mapping
from numbers import Real
from types import UnionType
from typing import Any

import numpy as np

from gaitopt.arguments import check_record, is_masked
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest

__all__ = ["Parameter"]


_NO_NUMBERS = (str, bytes, bytearray, complex, bool, np.bool_)
"""Types whose values Python converts to numbers although they are something else."""

NONNEGATIVE = ("mass", "inertia", "length", "friction")
"""Ends of the names of parameters that are not negative."""

LARGEST_COUNT = 2.0**53
"""Largest count or seed: all whole numbers up to it have a floating-point representation."""


@check_record
@dataclass(frozen=True)
class Parameter:
    """A named real number with a unit and an interval of valid values.

    Attributes
    ----------
    name : str
        Identifier, the same in Python, files and on the command line.
    default : float
        Default value, in `unit`.
    unit : str
        Unit, ``"1"`` if the number is dimensionless.
    lower, upper : float
        Bounds; `lower` is excluded when `lower_open`.  By default names that end with mass, inertia, length or friction
        have the lower bound 0.
    infinite, whole : bool
        Whether infinity is valid, and whether only whole numbers are.
    at_most : str
        Another parameter of the same robot that this one may not exceed; none if empty.
    description : str
        Description in one line.

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

    def __post_init__(self) -> None:
        if math.isinf(self.lower) and self.name.endswith(NONNEGATIVE):
            object.__setattr__(self, "lower", 0.0)
        if type(self.default) in (int, float) and self.default == self.default:  # check_record refuses others
            try:
                self.check(self.default)
            except InputError as error:
                raise InputError(f"The default of a parameter is invalid: {error}") from None

    def check(self, value: object) -> float:
        """Return `value` as a float, or raise :class:`InputError` with the valid values.

        Examples
        --------
        >>> Parameter("leg_mass", 4.0, "kg", "mass of a leg", lower=0, lower_open=True).check(5)
        5.0
        """
        try:
            # The numbers of a problem are floats already, and a solve checks them some thousand times.
            invalid = type(value) is not float and (isinstance(value, _NO_NUMBERS) or is_masked(value))
            number = math.nan if invalid else float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError, RuntimeError):  # the last one by CasADi
            number = math.nan
        if math.isnan(number) and not isinstance(value, float):
            raise InputError(f"{self.name} must be a number{self._unit()}, got {value!r}.")
        if math.isnan(number) or (math.isinf(number) and not self.infinite):
            raise InputError(f"{self.name} must be a finite number{self._unit()}, got {number}.")
        if self.whole and number != int(number):
            raise InputError(f"{self.name} must be a whole number{self._unit()}, got {value!r}.")
        low = number <= self.lower if self.lower_open else number < self.lower
        if low or number > self.upper:
            hint = self._propose_radians(number)
            raise InputError(f"{self.name} must be {self._interval()}{self._unit()}, got {number:g}.{hint}")
        return number

    def _propose_radians(self, number: float) -> str:
        """Return a sentence with an invalid angle converted from degrees, if it is then valid; otherwise nothing."""
        angle = math.radians(number)
        valid = self.unit == "rad" and abs(number) > 1 and self.lower <= angle <= self.upper
        return f" If the value is in degrees, state {angle:.4g} rad." if valid else ""

    def _unit(self) -> str:
        return "" if self.unit == "1" else f" [{self.unit}]"

    def _interval(self) -> str:
        below = f"{'greater than' if self.lower_open else 'at least'} {self.lower:g}"
        above = f"at most {self.upper:g}"
        if math.isinf(self.upper):
            return below
        return above if math.isinf(self.lower) else f"{below} and {above}"


@functools.lru_cache(maxsize=1024)
def recall_parameter(name: str, unit: str = "1", **interval: Any) -> Parameter:
    """Return a parameter without description and with any valid default, the same object for the same arguments.

    Examples
    --------
    >>> recall_parameter("intervals", lower=2, whole=True).check(20)
    20.0
    """
    lower, upper = interval.get("lower", 0.0), interval.get("upper", math.inf)
    valid = upper if math.isfinite(upper) else lower + 1.0 if math.isfinite(lower) else 0.0
    return Parameter(name, valid, unit, "", **interval)


def resolve(parameters: tuple[Parameter, ...], values: Mapping[str, object], owner: str) -> dict[str, float]:
    """Fill in defaults and check every value.

    Parameters
    ----------
    parameters : tuple of Parameter
        Known parameters, in order.
    values : mapping
        Values by name.
    owner : str
        Object with these parameters, for the error message.

    Returns
    -------
    dict
        Every parameter in the order of `parameters`.

    Raises
    ------
    InputError
        If a name is unknown or a value violates its bounds, one of which may be another parameter.

    Examples
    --------
    >>> resolve((Parameter("gravity", 9.8, "m/s^2", "gravity"),), {}, "robot")
    {'gravity': 9.8}
    """
    names = [parameter.name for parameter in parameters]
    for name in values:
        if name not in names:
            raise InputError(f"{owner} has no parameter {name!r}. {suggest(name, names)}")
    numbers = {p.name: p.check(values.get(p.name, p.default)) for p in parameters}
    for p in parameters:
        if p.at_most and numbers[p.name] > numbers[p.at_most]:
            default = "" if p.name in values else ", its default"
            raise InputError(
                f"{p.name} ({p.description}) must be at most {p.at_most} = {numbers[p.at_most]:g}{p._unit()}, "
                f"got {numbers[p.name]:g}{default}."
            )
    return numbers


Validator = Callable[[Any, Any, Any], None]
"""Validator of an attrs class: called with the object, the attribute and its value."""


def number_within(
    unit: str = "1",
    lower: float = -math.inf,
    upper: float = math.inf,
    *,
    lower_open: bool = False,
    infinite: bool = False,
    whole: bool = False,
) -> Validator:
    """Return a validator of an attrs class for a number; its message names the class and the attribute.

    Examples
    --------
    >>> import attrs
    >>> @attrs.frozen(kw_only=True)
    ... class Method:
    ...     order: int = attrs.field(default=4, validator=number_within(lower=1, whole=True))
    >>> Method(order=0)
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Method.order must be at least 1, got 0.
    """
    interval = {"lower": lower, "upper": upper, "lower_open": lower_open, "infinite": infinite, "whole": whole}

    def validate(options: Any, attribute: Any, value: Any) -> None:
        name = f"{type(options).__name__}.{attribute.name}"
        if isinstance(value, str | bytes | bytearray | complex) or (whole and isinstance(value, bool)):
            raise InputError(f"{name} must be a {'whole ' if whole else ''}number, got {value!r}.")
        recall_parameter(name, unit, **interval).check(value)

    return validate


def whole_number(lower: int = 1, upper: float = math.inf) -> Validator:
    """Return a validator of an attrs class for a whole number, which floating-point numbers represent exactly."""
    within = number_within(lower=lower, upper=upper, whole=True)
    exact = number_within(upper=LARGEST_COUNT, whole=True)

    def validate(options: Any, attribute: Any, value: Any) -> None:
        within(options, attribute, value)
        exact(options, attribute, value)

    return validate


def positive(unit: str = "1", upper: float = math.inf, *, infinite: bool = False) -> Validator:
    """Return a validator of an attrs class for a number greater than 0."""
    return number_within(unit, 0.0, upper, lower_open=True, infinite=infinite)


def optional(validator: Validator) -> Validator:
    """Return a validator of an attrs class that also accepts None."""
    return lambda options, attribute, value: None if value is None else validator(options, attribute, value)


def instance_of(*kinds: type, example: str) -> Validator:
    """Return a validator of an attrs class for an object of some types; its message states an example."""

    def validate(options: Any, attribute: Any, value: Any) -> None:
        if not isinstance(value, kinds):
            raise InputError(f"{type(options).__name__}.{attribute.name} must be {example}, got {value!r}.")

    return validate


def check_type(name: str, value: object, kind: type | UnionType, example: str) -> None:
    """Raise InputError unless an argument has a type; the message states an example.

    Examples
    --------
    >>> check_type("gait", "walk.h5", int, "a Gait such as load('walk.h5')")
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: gait must be a Gait such as load('walk.h5'), got 'walk.h5'.
    """
    if isinstance(value, kind):
        return
    if callable(value) and not isinstance(value, type) and (function := getattr(value, "__name__", None)):
        raise InputError(f"{name} must be {example}, got the function {function}; call it: {function}().")
    raise InputError(f"{name} must be {example}, got {value!r}.")


def callable_with(arguments: str) -> Validator:
    """Return a validator of an attrs class for a function; its message states the arguments."""

    def validate(options: Any, attribute: Any, value: Any) -> None:
        if not callable(value):
            name = f"{type(options).__name__}.{attribute.name}"
            raise InputError(f"{name} must be a function that is called with {arguments}, got {value!r}.")

    return validate


def as_float(value: Any) -> Any:
    """Return a number of any kind as a float, and anything else as it is: a converter of an attrs class.

    Examples
    --------
    >>> as_float(1), as_float(None)
    (1.0, None)
    """
    return float(value) if isinstance(value, Real) and not isinstance(value, bool) else value


def as_vector(parameters: tuple[Parameter, ...], values: Mapping[str, float]) -> np.ndarray:
    """Return the values as a vector in the order of `parameters`, shape ``(n,)``; InputError if one is missing."""
    missing = [p.name for p in parameters if p.name not in values]
    if missing:
        raise InputError(f"The robot's parameter {missing[0]!r} has no value. Known: {', '.join(values)}.")
    return np.array([values[p.name] for p in parameters], dtype=float)
