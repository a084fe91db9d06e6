"""The consoles of Rich on which a command prints."""

import sys
from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from gaitopt.motion.printable import replace_controls


class PlainConsole(Console):
    """A console on which no text of a file or script is an instruction to the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """Yield the parts of an output, with question marks in place of control characters."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(replace_controls(part.text), part.style)


def make_console(*, stderr: bool) -> PlainConsole:
    """Return the console of standard output or standard error.

    A file or a pipe has no width: numbers must not be cut there to fit a terminal.  Markup is off: Rich would remove
    units such as "[m/s]" from columns and messages.  Colour is given as a Text.
    """
    width = None if stderr or sys.stdout.isatty() else 140
    return PlainConsole(stderr=stderr, highlight=False, markup=False, emoji=False, width=width)
