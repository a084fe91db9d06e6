"""Conversion of texts and paths of the command line without the validation library of Typer.

Typer validates every value, also of options that are not given, with pydantic, whose import takes longer than that of
CasADi.  Texts, paths and the defaults of options that are not given need no validation.
"""

import os
from pathlib import Path
from typing import Any, get_args

_FLAGS = ("exists", "writable", "executable", "resolve_path", "allow_dash", "path_type", "parser")
"""Settings of a parameter that state further conditions on its values."""


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
