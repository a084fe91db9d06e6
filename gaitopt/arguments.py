"""Arguments of public functions and classes: a wrong type or name is reported in a sentence that names the argument.

The functions check values and combinations themselves.  If one ends in another error, its arguments are compared with
annotations: one that does not fit them is the cause.  A call that succeeds is not delayed.  The arguments of some
records, such as the bodies of a robot, are always compared (:func:`check_record`), since they are read later.
"""

import functools
import inspect
import math
import os
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from gaitopt.errors import NAN_CAUSES, GaitoptError, InputError, suggest

F = TypeVar("F", bound=Callable[..., Any])
R = TypeVar("R")

MOST_ITEMS = 1000
"""Number of items of a sequence or mapping that are compared with the annotation."""

_ARRAYS = (np.ndarray, NDArray)
"""Types of arrays; NDArray is an alias of np.ndarray before NumPy 2.5, and another type since then."""

_PLAIN = (str, float, int, bool, type(None))
MOST_KEYS = 1000
"""Number of combinations of plain arguments of a record that are remembered as valid."""

EXPRESSION = "a CasADi expression (SX)"
_NAMES = {float: "a number", int: "a whole number", str: "a string", bool: "True or False", Path: "a path"}


class ArgumentError(InputError):
    """An argument of a wrong type or an unknown name, in a call by the user or in one that follows from it."""


def check_arguments(target: F) -> F:
    """Decorate a function or class: an error of a wrong type or keyword becomes an InputError that names the argument.

    Parameters
    ----------
    target : function or class

    Returns
    -------
    function or class
        The class itself, or a function with the same signature.

    Raises
    ------
    InputError
        By the decorated function, if it fails and an argument does not fit its annotation.

    Examples
    --------
    >>> @check_arguments
    ... def double(width: float) -> float:
    ...     return 2 + width
    >>> double("6")
    Traceback (most recent call last):
    ...
    gaitopt.arguments.ArgumentError: double: width must be a number, got '6'.
    """
    if isinstance(target, type):
        target.__init__ = _wrap(target.__init__, target.__name__)  # type: ignore[misc]
        return cast("F", target)
    return cast("F", _wrap(target, target.__name__))


def check_record(target: F) -> F:
    """Decorate a class of records: every argument is compared with its annotation when a record is made.

    Numbers are accepted where a CasADi expression is expected.

    Parameters
    ----------
    target : class

    Returns
    -------
    class
        The class itself.

    Raises
    ------
    InputError
        By the class, if an argument does not fit its annotation.

    Examples
    --------
    >>> from gaitopt.dataclass import dataclass
    >>> @check_record
    ... @dataclass
    ... class Length:
    ...     value: float
    >>> Length("6")
    Traceback (most recent call last):
    ...
    gaitopt.arguments.ArgumentError: Length: value must be a number, got '6'.
    """
    setattr(target, "__init__", _wrap(vars(target)["__init__"], target.__name__, always=True))  # noqa: B010
    return target


def make_record(kind: type[R], *arguments: Any, **options: Any) -> R:
    """Return a record (see `check_record`) without comparing its arguments, which would slow a simulation down."""
    record = object.__new__(kind)
    vars(kind)["__init__"].__wrapped__(record, *arguments, **options)
    return record


def _wrap(function: Callable[..., Any], name: str, *, always: bool = False) -> Callable[..., Any]:
    valid: set[tuple[Any, ...]] = set()  # keys of arguments that fit: a solve makes the same records again and again

    @functools.wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            result = function(*arguments, **options)
        except Exception as error:
            known = isinstance(error, GaitoptError | MemoryError) and not isinstance(error, ArgumentError)
            wrong = None if known else _find_wrong_argument(function, name, arguments, options, numbers=always)
            if wrong is None:
                raise
            raise ArgumentError(wrong) from error
        key = _key_of(function, arguments, options) if always else None
        if always and (key is None or key not in valid):
            wrong = _find_wrong_argument(function, name, arguments, options, numbers=True)
            if wrong is not None:
                raise ArgumentError(wrong)
            if key is not None and len(valid) < MOST_KEYS:
                valid.add(key)
        return result

    return call


def _key_of(
    function: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]
) -> tuple[Any, ...] | None:
    """Return a key of plain arguments, types included; None if one of them is of another type.

    Of expressions where they are expected, only the type matters.
    """
    key, expected = list[Any](), _list_expressions(function)
    for name, value in (*list(enumerate(arguments))[1:], *options.items()):
        if type(value) in _PLAIN:
            key.append((name, type(value), value))
        elif name in expected and type(value).__name__ == "SX":
            key.append((name, type(value)))
        else:
            return None
    return tuple(key)


@functools.lru_cache(maxsize=1024)
def _list_expressions(function: Callable[..., Any]) -> frozenset[int | str]:
    """Return positions and names of the arguments that are annotated as expressions of CasADi."""
    parameters = enumerate(_read_signature(function).parameters.values())
    places = [(i, one.name) for i, one in parameters if getattr(one.annotation, "__name__", "") == "SX"]
    return frozenset(place for pair in places for place in pair)


def _find_wrong_argument(
    function: Callable[..., Any],
    name: str,
    arguments: tuple[Any, ...],
    options: dict[str, Any],
    *,
    numbers: bool = False,
) -> str | None:
    """Return a sentence on the first argument that is unknown or does not fit its annotation; None if all are valid.

    A text in place of an object comes last, because it may be its accepted name, such as a contact sequence.
    With `numbers`, numbers fit where an expression is expected.
    """
    signature = _read_signature(function)
    try:
        bound = signature.bind(*arguments, **options)
    except TypeError:
        return _find_unknown_argument(signature, name, len(arguments), options)  # Python names a missing argument
    named = None
    for argument, value in bound.arguments.items():
        parameter = signature.parameters[argument]
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        kind = _resolve(parameter.annotation, function)
        if value is not parameter.default and not _fits(value, kind, numbers):
            number = "a finite number or " if numbers else ""
            accepted = _describe(kind).replace(EXPRESSION, f"{number}{EXPRESSION}")
            cause = f": {NAN_CAUSES}" if number and isinstance(value, float) and math.isnan(value) else ""
            wrong = f"{name}: {argument} must be {accepted}, got {_shorten(value)}{cause}."
            if not (isinstance(value, str) and getattr(kind, "__module__", "").startswith("gaitopt.")):
                return wrong
            named = named or wrong
    return named


def _find_unknown_argument(signature: inspect.Signature, name: str, count: int, options: dict[str, Any]) -> str | None:
    """Return a sentence on the first unknown keyword, or on more than the accepted arguments without names; or None."""
    parameters = list(signature.parameters.values())
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    known = [one.name for one in parameters if one.name != "self" and one.kind is not one.POSITIONAL_ONLY]
    positional = [one.name for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    several = any(one.kind is one.VAR_POSITIONAL for one in parameters)
    if not known and getattr(signature.return_annotation, "__name__", "").endswith("Robot"):
        values = ", ".join(f"{option!r}: {_shorten(value)}" for option, value in options.items()) or "..."
        return f"{name} has no arguments. State parameters of the robot in the problem: parameters={{{values}}}."
    if count > len(positional) and not several:
        listed = [one for one in positional if one != "self"]
        keywords = ", ".join(f"{one.name}=..." for one in parameters if one.kind is one.KEYWORD_ONLY)
        more = f"; the others are given by name: {keywords}" if keywords else ""
        if len(listed) == 1 and "a sequence of" in _describe(signature.parameters[listed[0]].annotation):
            return f"{name}: {listed[0]} is a single argument; several are given as a list, {name}([..., ...]){more}."
        return f"{name}: only the arguments {', '.join(listed)} are accepted without their names{more}."
    public, unknown = [one for one in known if not one.startswith("_")], [name for name in options if name not in known]
    return f"{name} has no argument {unknown[0]!r}. {suggest(unknown[0], public)}" if unknown else None


@functools.lru_cache(maxsize=1024)
def _read_signature(function: Callable[..., Any]) -> inspect.Signature:
    """Return the signature of a function, cached because the arguments of a function are checked at every call."""
    return inspect.signature(function)


def _shorten(value: object) -> str:
    try:
        text = repr(value)
    except Exception:
        text = f"a {type(value).__name__}"
    return text if len(text) < 100 else f"{text[:97]}..."


def _resolve(kind: Any, function: Callable[..., Any]) -> Any:
    """Return an annotation as a type; Any if it is a text with names that are imported for type checkers only."""
    if kind is inspect.Parameter.empty:
        return Any
    if isinstance(kind, str):
        names = vars(sys.modules[function.__module__]) | _known_types()
        try:
            return eval(kind, names)
        except Exception:
            return Any
    return kind


def _known_types() -> dict[str, Any]:
    """Return the public classes of all loaded modules of gaitopt, and of labelled tables."""
    found: dict[str, Any] = {"xr": sys.modules.get("xarray"), "ca": sys.modules.get("casadi")}
    for name, module in list(sys.modules.items()):
        if name.startswith("gaitopt."):
            found |= {key: value for key, value in vars(module).items() if isinstance(value, type)}
    return found


def _fits(value: Any, kind: Any, numbers: bool = False) -> bool:
    """Return whether a value fits an annotation; one that is not understood fits every value."""
    origin = typing.get_origin(kind)
    if numbers and getattr(kind, "__name__", "") == "SX":
        # The type first: the conversion of an expression to an array, which fails, takes long.
        return isinstance(value, kind) or type(value).__name__ == "DM" or _is_finite(value)
    if kind is None or kind is type(None):
        return value is None
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, part, numbers) for part in typing.get_args(kind))
    if origin is typing.Literal:
        return any(value is each or (isinstance(value, str) and value == each) for each in typing.get_args(kind))
    if kind in _CHECKS:
        return _CHECKS[kind](value)
    if origin in _ARRAYS or kind in _ARRAYS:
        return _is_numeric(value)
    if isinstance(origin, type):
        return _fits_container(value, origin, typing.get_args(kind), numbers)
    if getattr(kind, "_is_protocol", False):
        return all(hasattr(value, name) for name in vars(kind) if not name.startswith("_"))
    return isinstance(value, kind) if isinstance(kind, type) else True


def _fits_container(value: Any, origin: type, parts: tuple[Any, ...], numbers: bool = False) -> bool:
    if issubclass(origin, Mapping):
        items = list(value.items())[:MOST_ITEMS] if isinstance(value, Mapping) else []
        return isinstance(value, Mapping) and all(
            _fits(key, parts[0], numbers) and _fits(item, parts[1], numbers) for key, item in items if len(parts) == 2
        )
    if origin in (Sequence, Iterable, list, tuple, set, frozenset):
        if isinstance(value, np.ndarray):
            value = value[:MOST_ITEMS].tolist() if value.ndim else None
        if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable) or _is_symbolic(value):
            return False
        if origin is Iterable and not isinstance(value, Sequence):
            return True  # which may be read once only
        kinds = parts if origin is tuple and parts and parts[-1] is not ... else None
        if not isinstance(value, Sequence | set | frozenset) or (kinds is not None and len(value) != len(kinds)):
            return False
        expected = kinds or [parts[0] if parts else Any] * len(value)
        return all(_fits(item, kind, numbers) for item, kind in zip(value, expected, strict=True))
    if origin is Callable or issubclass(origin, Callable):  # type: ignore[arg-type]
        return callable(value)
    return isinstance(value, origin)


def _is_symbolic(value: Any) -> bool:
    """Return whether a value is a matrix of CasADi, which refuses to be iterated over."""
    return type(value).__module__.partition(".")[0] == "casadi"


def _is_number(value: Any) -> bool:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    return isinstance(value, Real) and not isinstance(value, bool) and not math.isnan(value)


def _is_finite(value: Any) -> bool:
    """Return whether a value is a finite number, or an array of them."""
    return (_is_number(value) and not math.isinf(value)) or _is_numeric(value)


def _is_numeric(value: Any) -> bool:
    """Return whether a value is an array, or nested sequences, of finite numbers."""
    if isinstance(value, str | bytes | Mapping | bool) or value is None or is_masked(value):
        return False
    try:
        array = np.asarray(value)
        return array.ndim > 0 and array.dtype.kind in "iuf" and bool(np.all(np.isfinite(array)))
    except Exception:
        return False


_CHECKS: dict[Any, Callable[[Any], bool]] = {
    Any: lambda value: True,
    object: lambda value: True,
    float: _is_number,
    int: lambda value: isinstance(value, Integral) and not isinstance(value, bool),
    bool: lambda value: isinstance(value, bool | np.bool_),
    str: lambda value: isinstance(value, str),
    Path: lambda value: isinstance(value, os.PathLike),
}


def is_masked(value: object) -> bool:
    """Return whether a value is a masked array; numpy.ma, whose import is slow, is not imported.

    Examples
    --------
    >>> is_masked(np.ma.array([1.0], mask=[True])), is_masked(np.array([1.0]))
    (True, False)
    """
    masked = getattr(sys.modules.get("numpy.ma"), "MaskedArray", None)  # another thread may be importing it
    return masked is not None and isinstance(value, masked)


def check_vector(name: str, value: Any, size: int) -> NDArray[np.float64]:
    """Return a vector of finite numbers as an array, or raise InputError.

    Examples
    --------
    >>> check_vector("q", [0, 1], 3)
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: q must be a vector of 3 finite numbers, got [0, 1].
    """
    if not _is_numeric(value) or np.shape(value) != (size,):
        raise InputError(f"{name} must be a vector of {size} finite numbers, got {_shorten(value)}.")
    return np.asarray(value, dtype=float)


def _describe(kind: Any) -> str:
    """Return an annotation in words."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(_describe(part) for part in parts))
    if kind in (None, type(None)):
        return "None"
    if isinstance(kind, type) and kind in _NAMES:
        return _NAMES[kind]
    if getattr(kind, "__name__", "") == "SX":
        return EXPRESSION
    if origin is typing.Literal:
        return " or ".join(map(repr, parts))
    if origin in _ARRAYS or kind in _ARRAYS:
        return "an array of finite numbers"
    if isinstance(origin, type):
        if issubclass(origin, Mapping):
            return f"a mapping from {_describe(parts[0])} to {_describe(parts[1])}"
        if origin in (Sequence, Iterable, list, tuple, set, frozenset):
            return f"a sequence of {_describe(parts[0])}" if parts else "a sequence"
        return "a function"
    name = getattr(kind, "__name__", str(kind))
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"
