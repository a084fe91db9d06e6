"""Output of commands: tables for people, one JSON object for programs."""

import functools
import json
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from gaitopt.cli.stored_results import describe_stored_results
from gaitopt.motion.summary import plain
from gaitopt.progress import HomotopyIteration

if TYPE_CHECKING:
    from rich.text import Text

    from gaitopt.cli.console import PlainConsole

INTERRUPTED = 128 + signal.SIGINT
"""Exit status after Ctrl-C."""

TERMINAL_VARIABLES = ("FORCE_COLOR", "TTY_COMPATIBLE")
"""Environment variables with which Rich treats a file or a pipe as a terminal."""


class Output:
    """Standard output or standard error; its console is made at its first use, as a quiet command has no use of Rich.

    Parameters
    ----------
    stderr : bool

    Attributes
    ----------
    quiet : bool
        Whether nothing is printed.
    console : PlainConsole
    """

    def __init__(self, *, stderr: bool) -> None:
        self._stderr = stderr
        self.quiet = False

    @functools.cached_property
    def console(self) -> "PlainConsole":
        """The console of Rich."""
        from gaitopt.cli.console import make_console

        return make_console(stderr=self._stderr)

    @property
    def is_terminal(self) -> bool:
        """Whether the output is a terminal; for a file or a pipe, Rich need not be imported to know this."""
        stream = sys.stderr if self._stderr else sys.stdout
        if "console" in vars(self) or stream.isatty() or any(name in os.environ for name in TERMINAL_VARIABLES):
            return self.console.is_terminal
        return False

    def print(self, *objects: Any, **options: Any) -> None:
        """Print texts and tables with the options of :meth:`rich.console.Console.print`."""
        if not self.quiet:
            self.console.print(*objects, **options)


out = Output(stderr=False)
err = Output(stderr=True)


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object on standard output, without wrapping or colour; nan becomes null."""
    print(json.dumps(plain(data), indent=2, allow_nan=False))


def report_file(path: Path, remark: str = "", *, json: bool = False) -> None:
    """Print the file that was written, on one line however long, and a remark on it; or the file as a JSON object."""
    if json:
        print_json({"file": str(path)})
        return
    out.print(f"wrote {path}{f' ({remark})' if remark else ''}", soft_wrap=True)


def homotopy_lines(step: HomotopyIteration, objective: str) -> list[str]:
    """Return the lines of one step in the table of a homotopy; the first step has the header, too."""
    head = f"{'step':>4}  {'relaxation':>10}  {objective:>17}  {'complementarity':>15}  {'iterations':>10}  status"
    line = (
        f"{step.number:4d}  {step.relaxation:10.0e}  {step.objective:17.6g}  {step.complementarity:15.1e}  "
        f"{step.iterations:10d}  {step.status}"
    )
    return [head, line] if step.number == 1 else [line]


def print_reason(reason: str) -> None:
    """Print why a command fails on standard error if ``--quiet`` hides its table, which states the reason."""
    if out.quiet:
        err.print(reason, soft_wrap=True)


def verdict_text(text: str, good: bool) -> "Text":
    """Return a verdict in green if it is good, in red otherwise."""
    from rich.text import Text

    return Text(text, style="green" if good else "red")


def describe_incomplete(command: str, output: Path | None, written: str = "") -> str:
    """Return that a study is not complete, which results are stored, and how it is resumed.

    Parameters
    ----------
    command : str
    output : Path or None
    written : str
        Which results are written where, as a clause; empty if the stored results are those of the file.

    Examples
    --------
    >>> describe_incomplete("sweep", Path("no.nc"), "0 of 30 points are written to no.nc")
    'Incomplete: 0 of 30 points are written to no.nc. Run the same command again to resume.'
    """
    if output is None:
        return "Incomplete. With -o FILE, an incomplete study can be resumed."
    stored = describe_stored_results(command, output).removesuffix(".")
    facts = ", and ".join(filter(None, (written, stored[:1].lower() + stored[1:])))
    return f"Incomplete{': ' if facts else ''}{facts}. Run the same command again to resume."


def exit_incomplete(command: str, output: Path | None, written: str = "") -> NoReturn:
    """End with the exit status of a study that was interrupted, or could not compute every point."""
    err.print(describe_incomplete(command, output, written), soft_wrap=True)
    sys.exit(INTERRUPTED)  # not typer.Exit, which an interrupt of any other command becomes: "nothing was written"
