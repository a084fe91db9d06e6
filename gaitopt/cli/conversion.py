"""Conversion of texts and paths of the command line without the validation library of Typer.

Typer validates every value, also of options that are not given, with pydantic, whose import takes longer than that of
CasADi.  Texts, paths and the defaults of options that are not given need no validation.
"""

import math
import os
from pathlib import Path
from typing import Any, get_args

from typer import BadParameter

_FLAGS = ("exists", "writable", "executable", "resolve_path", "allow_dash", "path_type", "parser")
"""Settings of a parameter that state further conditions on its values."""


class NumberRange:
    """Valid numbers of an option, whose message names the invalid value and the valid ones.

    Parameters
    ----------
    kind : type
        int or float.
    conditions : typer.models.ParameterInfo
        With the smallest and the largest number.
    """

    def __init__(self, kind: type, conditions: Any) -> None:
        self._kind, self._least, self._most = kind, conditions.min, conditions.max

    def find_fault(self, item: Any) -> str:
        """Return what is wrong with a text that is to be a number, "" if nothing is."""
        if not isinstance(item, str):
            return ""
        try:
            number = self._kind(item)
        except ValueError:
            return f"must be {self._describe()}, got {item!r}."
        bounded = self._least is not None or self._most is not None
        low, high = self._least is not None and number < self._least, self._most is not None and number > self._most
        valid = not (low or high) and not (bounded and math.isnan(number))
        return "" if valid else f"must be {self._describe()}, got {item!r}."

    def _describe(self) -> str:
        name = "a whole number" if self._kind is int else "a number"
        if self._least is not None and self._most is not None:
            return f"{name} from {self._least:g} to {self._most:g}"
        least = "" if self._least is None else f" of at least {self._least:g}"
        return name + (least if self._most is None else f" of at most {self._most:g}")


class PlainConversion:
    """Conversion of the values of a parameter: to texts or paths here, and to anything else by Typer.

    Parameters
    ----------
    parameter : TyperOption or TyperArgument
    """

    def __init__(self, parameter: Any) -> None:
        self._convert = parameter.get_runtime_param
        annotation, conditions = parameter.type_descriptor.annotation, parameter.type_descriptor.parameter_info
        kind = next(iter(get_args(annotation)), annotation)
        plain = kind in (str, Path) and not any(getattr(conditions, name, None) for name in _FLAGS)
        self._kind = kind if plain and conditions.file_okay and conditions.dir_okay else None
        self._range = NumberRange(kind, conditions) if kind in (int, float) else None

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the value that the command receives."""
        several = param.multiple or param.nargs == -1
        if value is None:
            return () if several else None
        if type(value) in (int, float, bool) and value == param.default:
            return value
        items = list(value) if several and not isinstance(value, str) else [value]
        if several == isinstance(value, list | tuple) and all(map(self._is_plain, items)):
            values = [self._kind(item) for item in items]  # type: ignore[misc]
            return values if several else values[0]
        if self._range is not None and (fault := next(filter(None, map(self._range.find_fault, items)), "")):
            raise BadParameter(fault, ctx=ctx, param=param)
        return self._convert().coerce(value, param=param, ctx=ctx)

    def _is_plain(self, item: Any) -> bool:
        """Return whether an item is a text, or a path that is readable or does not exist."""
        if self._kind is None or not isinstance(item, str | Path) or "\0" in str(item):
            return False
        return self._kind is str or os.access(item, os.R_OK) or not os.access(item, os.F_OK)


def convert_plainly(parameters: list[Any]) -> list[Any]:
    """Return the parameters of a command, which convert texts and paths themselves.

    Versions of Typer without pydantic do so anyway.
    """
    for parameter in parameters:
        if hasattr(parameter, "type_descriptor") and "get_runtime_param" not in vars(parameter):
            conversion = PlainConversion(parameter)
            parameter.get_runtime_param = lambda conversion=conversion: conversion
    return parameters
