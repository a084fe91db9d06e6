"""What commands print: tables for people, one JSON object for programs."""

import json
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from gaitopt.motion.gait import Gait
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.summary import plain
from gaitopt.progress import HomotopyIteration

INTERRUPTED = 128 + signal.SIGINT
"""Exit status of what Ctrl-C has ended."""

# A file or a pipe has no width of its own: numbers must not be cut there to fit a terminal.
out = Console(highlight=False, width=None if sys.stdout.isatty() else 140)
err = Console(stderr=True, highlight=False)


@contextmanager
def working(what: str, *, hidden: bool) -> Iterator[None]:
    """Show what is being done, and for how long, where nothing can be counted."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=hidden) as progress:
        progress.add_task(what, total=None)
        yield


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object on standard output, whatever numbers it holds, as it is (no wrapping, no colour)."""
    print(json.dumps(plain(data), indent=2, allow_nan=False))


def print_written(path: Path, *, json: bool = False) -> None:
    """Print which file was written, on one line however long, or as a JSON object."""
    if json:
        print_json({"file": str(path)})
        return
    out.print(f"wrote {escape(str(path))}", soft_wrap=True)


def homotopy_lines(step: HomotopyIteration, objective: str) -> list[str]:
    """Return a homotopy's table as it grows: the line of a step, before the first one the names of the columns."""
    head = f"{'step':>4}  {'relaxation':>10}  {objective:>17}  {'complementarity':>15}  {'iterations':>10}  status"
    line = (
        f"{step.number:4d}  {step.relaxation:10.0e}  {step.objective:17.6g}  {step.complementarity:15.1e}  "
        f"{step.iterations:10d}  {step.status}"
    )
    return [head, line] if step.number == 1 else [line]


def print_gait(gait: Gait) -> None:
    """Print the facts of a gait as a table."""
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, text in tabulate_gait(gait):
        table.add_row(name, _coloured(gait, name, text))
    out.print(table)


def _coloured(gait: Gait, name: str, text: str) -> str:
    """Return a fact with its verdict, the part before the colon, in colour."""
    good = {"status": gait.status.ok, "replay": gait.verification is not None and gait.verification.passed}
    verdict, colon, rest = text.partition(":")
    if name in good and colon:
        return f"[{'green' if good[name] else 'red'}]{escape(verdict)}[/]:{escape(rest)}"
    return f"[yellow]{escape(text)}[/]" if name == "warning" else escape(text)


def leave_unfinished(*, kept: bool = True) -> NoReturn:
    """End with the exit status of a study that was interrupted, or could not do everything."""
    err.print("Not complete: the same command goes on." if kept else "Not complete; with -o FILE it could go on.")
    sys.exit(INTERRUPTED)  # not typer.Exit, which an interrupt of any other command becomes: "nothing was written"
