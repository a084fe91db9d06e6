"""Commands whose help is printed literally: Rich must not read a unit such as ``[m/s]`` as markup and remove it."""

import copy
from typing import Any

from rich.markup import escape
from typer.core import TyperCommand, TyperGroup


class Command(TyperCommand):
    """A command with literal help."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        super(Command, _escape_help(self)).format_help(ctx, formatter)


class CommandGroup(TyperGroup):
    """A group of commands with literal help."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        group = _escape_help(self)
        group.commands = {name: _escape_help(command) for name, command in self.commands.items()}
        super(CommandGroup, group).format_help(ctx, formatter)


def _escape_help(command: Any) -> Any:
    """Return a copy of a command in whose help texts the markup characters are escaped."""
    escaped = copy.copy(command)
    escaped.params = [copy.copy(parameter) for parameter in command.params]
    for each in (escaped, *escaped.params):
        for name in ("help", "short_help", "epilog"):
            if text := getattr(each, name, None):
                setattr(each, name, escape(text))
    return escaped
