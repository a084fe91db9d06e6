"""Commands whose help is printed literally, and whose output replaces no input of theirs.

Rich must not read a unit in the help, such as ``[m/s]``, as markup and remove it, and must not keep the line breaks
of the source within a paragraph.
"""

import copy
import os
from collections.abc import Iterator, Mapping
from inspect import cleandoc
from pathlib import Path
from typing import Any

from typer.core import TyperCommand, TyperGroup

from gaitopt.cli.conversion import convert_plainly
from gaitopt.cli.output_files import check_output
from gaitopt.cli.stored_results import Invocation
from gaitopt.errors import InputError


class Command(TyperCommand):
    """A command with literal help."""

    def get_params(self, ctx: Any) -> Any:
        """Return the parameters, which convert texts and paths themselves; flags have no type on the help page."""
        return hide_flag_types(convert_plainly(super().get_params(ctx)))

    def invoke(self, ctx: Any) -> Any:
        """Run the command, which its invocation names; raise an error if its output may not be written."""
        if isinstance(ctx.obj, Invocation):
            ctx.obj.command, ctx.obj.output = ctx.info_name or "", ctx.params.get("output")
        require_separate_output(ctx.params)
        check_output(ctx.info_name or "", ctx.params)
        return super().invoke(ctx)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        super(Command, _escape_help(self)).format_help(ctx, formatter)


class CommandGroup(TyperGroup):
    """A group of commands with literal help."""

    def get_params(self, ctx: Any) -> Any:
        """Return the parameters, which convert texts and paths themselves; flags have no type on the help page."""
        return hide_flag_types(convert_plainly(super().get_params(ctx)))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        group = _escape_help(self)
        group.commands = {name: _escape_help(command) for name, command in self.commands.items()}
        super(CommandGroup, group).format_help(ctx, formatter)


def hide_flag_types(parameters: list[Any]) -> list[Any]:
    """Return the parameters of a command, of which flags have no type on the help page, since they take no value.

    Versions of Typer that are based on Click show none anyway.
    """
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.display_type_rich = lambda ctx: None
    return parameters


def require_separate_output(parameters: Mapping[str, Any]) -> None:
    """Raise InputError if ``output`` is a file that another parameter of a command names.

    Examples
    --------
    >>> require_separate_output({"file": "README.md", "output": "./README.md"})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: The output ./README.md is an input of this command; choose another file with -o.
    """
    output = parameters.get("output")
    inputs = {name: value for name, value in parameters.items() if name != "output"}
    if output is not None and any(_is_same_file(path, output) for path in _texts(inputs)):
        raise InputError(f"The output {output} is an input of this command; choose another file with -o.")


def _is_same_file(one: str, other: str) -> bool:
    """Return whether two paths are the same existing file."""
    try:
        return Path(one).samefile(other)
    except (OSError, ValueError):
        return False


def _texts(parameters: Mapping[str, Any]) -> Iterator[str]:
    """Yield the texts and paths among the values of parameters, in lists also."""
    for value in parameters.values():
        for item in value if isinstance(value, list | tuple) else [value]:
            if isinstance(item, str | os.PathLike):
                text = os.fspath(item)
                yield from {text, text.partition(":")[0]}  # --law SCRIPT.py:FUNCTION


def _escape_help(command: Any) -> Any:
    """Return a copy of a command in whose help texts the markup characters are escaped."""
    from rich.markup import escape

    escaped = copy.copy(command)
    escaped.params = [copy.copy(parameter) for parameter in command.params]
    for each in (escaped, *escaped.params):
        for name in ("help", "short_help", "epilog"):
            if text := getattr(each, name, None):
                setattr(each, name, escape(_join_lines(text)))
    return escaped


def _join_lines(text: str) -> str:
    """Return a help text whose paragraphs are one line each, which the terminal wraps to its width."""
    return "\n\n".join(paragraph.replace("\n", " ") for paragraph in cleandoc(text).split("\n\n"))
