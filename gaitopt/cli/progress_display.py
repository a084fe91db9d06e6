"""Progress on standard error: a live line on a terminal, otherwise a line after ten seconds and every half minute."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gaitopt.cli.output import err, out

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

FIRST, PERIOD = 10.0, 30.0
"""Time until the first line and between two lines if standard error is not a terminal [s]."""


class Display:
    """The state of some work in words, and a count of what is done if there is a total.

    Parameters
    ----------
    text : str
    progress : Progress or None
        The live line of a terminal.
    """

    def __init__(self, text: str, progress: "Progress | None" = None) -> None:
        self._text, self._count, self._progress = text, "", progress
        self._task = None if progress is None else progress.add_task(text, total=None, count="")

    @property
    def line(self) -> str:
        """The state in one line."""
        return f"{self._text} {self._count}".rstrip()

    def describe(self, text: str) -> None:
        """Show another text, and no count."""
        self._text, self._count = text, ""
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, description=text, total=None, count="")

    def count(self, done: int, total: int) -> None:
        """Show how much is done; the total may grow."""
        self._count = f"{done}/{total}"
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, completed=done, total=total, count=self._count)


@contextmanager
def show_progress(text: str, *, hidden: bool, counted: bool = False) -> Iterator[Display]:
    """Yield a display of work in progress, which is hidden with ``--quiet`` or if `hidden`.

    Parameters
    ----------
    text : str
        The work in progress.
    hidden : bool
    counted : bool
        Whether a bar is shown beside the count.
    """
    if hidden or out.quiet:
        yield Display(text)
    elif err.is_terminal:
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns: list[ProgressColumn] = [SpinnerColumn(), TextColumn("{task.description}", markup=False)]
        columns += [BarColumn()] if counted else []
        columns += [TextColumn("{task.fields[count]}", markup=False), TimeElapsedColumn()]
        with Progress(*columns, console=err.console, transient=True) as progress:
            yield Display(text, progress)
    else:
        display, finished = Display(text), threading.Event()
        writer = threading.Thread(target=_write_lines, args=(display, finished), daemon=True)
        writer.start()
        try:
            yield display
        finally:
            finished.set()
            writer.join()


def _write_lines(display: Display, finished: threading.Event) -> None:
    """Print the state of the work at regular times until it is finished."""
    began, wait = time.perf_counter(), min(FIRST, PERIOD)
    while not finished.wait(wait):
        wait = PERIOD
        err.print(f"{display.line} ({time.perf_counter() - began:.0f} s)", soft_wrap=True)
