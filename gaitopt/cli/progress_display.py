"""Progress on standard error: a live line on a terminal, otherwise lines at growing intervals."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gaitopt.cli.output import err, out

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.progress import Progress, ProgressColumn

FIRST, PERIOD = 3.0, 30.0
"""Time until the first line if standard error is not a terminal, and longest time between two lines [s]; each interval
is twice as long as the one before."""


class Display:
    """The state of some work in words, and a count of what is done if there is a total.

    Parameters
    ----------
    text : str
    progress : Progress or None
        The live line of a terminal.
    unit : str
        What is counted, in the plural; empty if the text states it.

    Attributes
    ----------
    detail : callable
        Returns the progress of a task under way, by its name; empty if it is not known.
    """

    def __init__(self, text: str, progress: "Progress | None" = None, unit: str = "") -> None:
        self._text, self._count, self._progress, self._unit = text, "", progress, unit
        self._names = tuple[str, ...]()
        self.detail: Callable[[str], str] = _no_detail
        self._task = None if progress is None else progress.add_task(text, total=None, count="")

    @property
    def line(self) -> str:
        """The state in one line."""
        return f"{self._text} {self._count}".rstrip()

    def describe(self, text: str) -> None:
        """Show another text, and neither a count nor tasks under way."""
        self._text, self._count, self._names = text, "", ()
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, description=text, total=None, count="")

    def count(self, done: int, total: int, remark: str = "") -> None:
        """Show how much is done, with a remark; the total may grow."""
        self._count = " ".join(filter(None, (f"{done}/{total}", self._unit, remark)))
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, completed=done, total=total, count=self._count)

    def show_active(self, names: tuple[str, ...]) -> None:
        """Show the names of the tasks under way."""
        self._names = names

    @property
    def active(self) -> str:
        """The tasks under way with their progress, in words; empty if they are not known."""
        details = [(name, self.detail(name)) for name in self._names]
        shown = [f"{name} ({detail})" if detail else name for name, detail in details]
        return f"under way: {'; '.join(shown)}" if shown else ""


def _no_detail(name: str) -> str:
    """Return no progress of a task."""
    return ""


@contextmanager
def show_progress(text: str, *, hidden: bool, counted: str = "", longest: float | None = None) -> Iterator[Display]:
    """Yield a display of work in progress, which is hidden with ``--quiet`` or if `hidden`.

    Parameters
    ----------
    text : str
        The work in progress.
    hidden : bool
    counted : str
        What is counted, in the plural, beside a bar; empty for no bar.
    longest : float, optional
        Longest time between two lines if standard error is not a terminal [s], by default `PERIOD`.
    """
    if hidden or out.quiet:
        yield Display(text)
    elif err.is_terminal:
        from rich.live import Live

        progress = _make_bar(bool(counted))
        display = Display(text, progress, counted)
        live = Live(
            console=err.console,
            transient=True,
            refresh_per_second=progress.live.refresh_per_second,
            get_renderable=lambda: _render(progress, display),
        )
        with live:
            yield display
    else:
        display, finished = Display(text, unit=counted), threading.Event()
        writer = threading.Thread(target=_write_lines, args=(display, finished, longest or PERIOD), daemon=True)
        writer.start()
        try:
            yield display
        finally:
            finished.set()
            writer.join()


def estimate_remaining_time(display: Display) -> Callable[[int, int], None]:
    """Return a function that shows how much is done, and the time that the rest takes at the same rate from now on."""
    began = time.perf_counter()

    def count(done: int, total: int) -> None:
        seconds = (time.perf_counter() - began) / done * (total - done)
        display.count(done, total, f"(about {seconds:.0f} s left)" if done < total else "")

    return count


def _make_bar(counted: bool) -> "Progress":
    """Return the live line of a terminal, with a bar if work is counted."""
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns: list[ProgressColumn] = [SpinnerColumn(), TextColumn("{task.description}", markup=False)]
    columns += [BarColumn()] if counted else []
    columns += [TextColumn("{task.fields[count]}", markup=False), TimeElapsedColumn()]
    return Progress(*columns, console=err.console)


def _render(progress: "Progress", display: Display) -> "RenderableType":
    """Return the live line, and below it the tasks under way as one line that is cut off at the width of a terminal."""
    from rich.console import Group
    from rich.text import Text

    active = display.active
    below = [Text(f"  {active}", style="dim", no_wrap=True, overflow="ellipsis")] if active else []
    return Group(progress.get_renderable(), *below)


def _write_lines(display: Display, finished: threading.Event, longest: float) -> None:
    """Print the state of the work at growing intervals until it is finished."""
    began, wait = time.perf_counter(), min(FIRST, longest)
    while not finished.wait(wait):
        wait = min(2 * wait, longest)
        active = f", {text}" if (text := display.active) else ""
        err.print(f"{display.line} ({time.perf_counter() - began:.0f} s){active}", soft_wrap=True)
