"""Commands whose help is printed literally: Rich must not read a unit such as ``[m/s]`` as markup and remove it.

Their texts and paths are read without Pydantic, by which Typer converts values and whose import takes a twentieth of a
short solve.
"""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.markup import escape
from typer.core import TyperCommand, TyperGroup


class Command(TyperCommand):
    """A command with literal help."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, that of the help included."""
        return _convert_without_pydantic(super().get_params(ctx))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        super(Command, _escape_help(self)).format_help(ctx, formatter)


class CommandGroup(TyperGroup):
    """A group of commands with literal help."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, that of the help included."""
        return _convert_without_pydantic(super().get_params(ctx))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        group = _escape_help(self)
        group.commands = {name: _escape_help(command) for name, command in self.commands.items()}
        super(CommandGroup, group).format_help(ctx, formatter)


class Conversion:
    """Conversion of the value of one parameter, as Typer calls it: of texts and paths here, of others by Typer.

    Parameters
    ----------
    annotation : type
    """

    def __init__(self, annotation: Any) -> None:
        conversion: tuple[Callable[[str], Any] | None, bool] = TEXTS.get(annotation, (None, False))
        self._convert, self._repeated = conversion

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the value; None, or () of a parameter that may be repeated, if there is none."""
        if value is None:
            return () if param.multiple or param.nargs == -1 else None
        if self._convert is None:
            param._runtime_param = None  # which lets Typer make its own conversion
            return param.get_runtime_param().coerce(value, param=param, ctx=ctx)
        return [self._convert(each) for each in value] if self._repeated else self._convert(value)


TEXTS: dict[Any, tuple[Callable[[str], Any], bool]] = {
    str: (str, False),
    Path: (Path, False),
    list[str]: (str, True),
    list[Path]: (Path, True),
}
"""Conversion of the values of each type, and whether there are several."""


def _convert_without_pydantic(parameters: list[Any]) -> list[Any]:
    """Return parameters with their conversions; versions of Typer without Pydantic do not use them."""
    for parameter in parameters:
        if hasattr(parameter, "type_descriptor"):
            parameter._runtime_param = Conversion(parameter.type_descriptor.annotation)
    return parameters


def _escape_help(command: Any) -> Any:
    """Return a copy of a command in whose help texts the markup characters are escaped."""
    escaped = copy.copy(command)
    escaped.params = [copy.copy(parameter) for parameter in command.params]
    for each in (escaped, *escaped.params):
        for name in ("help", "short_help", "epilog"):
            if text := getattr(each, name, None):
                setattr(each, name, escape(text))
    return escaped
