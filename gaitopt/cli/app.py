"""The command line: one thin command per verb."""

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from gaitopt.cli import (
    basin_command,
    design_command,
    exporting,
    feedback,
    impact_command,
    listing,
    setup,
    solving,
    studies,
    trace_command,
    walking,
)
from gaitopt.cli.command import Command, CommandGroup
from gaitopt.cli.output import INTERRUPTED, err, print_json
from gaitopt.errors import GaitoptError, ScriptError
from gaitopt.interrupts import record_interrupts

ALLOCATIONS = 50_000
"""Number of new objects after which Python searches for unreachable ones."""

app = typer.Typer(
    name="gaitopt",
    cls=CommandGroup,
    help="Optimal-control gait design for planar walking with foot slippage.",
    epilog="Exit status: 0 success, 1 no gait found or a failed check, 2 invalid input, 130 interrupted.  "
    "gaitopt COMMAND --help shows an example of each command.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode="rich",
)
for command in (
    setup.new,
    solving.solve,
    solving.show,
    solving.verify,
    design_command.design,
    exporting.plot,
    exporting.animate,
    exporting.report,
    exporting.export,
    listing.problems,
    walking.simulate,
    walking.stability,
    trace_command.trace,
    impact_command.impact,
    feedback.tune,
    feedback.push,
    basin_command.basin,
    studies.run,
    studies.search,
    studies.sweep,
    studies.compare,
    setup.doctor,
):
    app.command(cls=Command)(command)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    if version:
        from gaitopt.version import __version__

        typer.echo(__version__)
        raise typer.Exit


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its status: 0 success, 1 no verified solution, 2 invalid input."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    with record_interrupts() as interrupt, _collect_rarely():
        try:
            status = app(words, prog_name="gaitopt", standalone_mode=False) or 0
        except (KeyboardInterrupt, typer.Abort):
            status = INTERRUPTED
        except Exception as error:
            explained = isinstance(error, GaitoptError) and not isinstance(error, ScriptError)
            status = INTERRUPTED if interrupt.received and not explained else _explain(error, words)
    if status == INTERRUPTED:
        _report(words, "interrupted", "Interrupted; nothing was written.")
        err.print("Interrupted; nothing was written.")
    sys.exit(status)


@contextmanager
def _collect_rarely() -> Iterator[None]:
    """Search for unreachable objects seldom: a command leaves few, and the search takes a twentieth of a solve."""
    thresholds = gc.get_threshold()
    gc.set_threshold(ALLOCATIONS, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)


def _explain(error: Exception, words: Sequence[str]) -> int:
    """Print an error of the input in one sentence and return the exit status; raise any other error."""
    if isinstance(error, GaitoptError):
        _report(words, "error", str(error))
        err.print(Text.assemble(("Error:", "red"), f" {error}"), soft_wrap=True)
        return 2
    if not (hasattr(error, "exit_code") and hasattr(error, "show") and hasattr(error, "format_message")):
        raise error
    _report(words, "error", error.format_message())  # a usage error of the command-line parser
    error.show()
    return int(error.exit_code)


def run_script(path: str) -> None:
    """Solve the problem of a script that is run as ``python SCRIPT``; further arguments are those of ``solve``."""
    main(["solve", str(Path(path)), *sys.argv[1:]])


def run_stability(path: str) -> None:
    """Find the gaits of a script that is run as ``python SCRIPT``; further arguments are those of ``stability``."""
    main(["stability", str(Path(path)), *sys.argv[1:]])


def run_study(path: str) -> None:
    """Run a study script that is run as ``python SCRIPT``; further arguments are those of ``run``."""
    main(["run", str(Path(path)), *sys.argv[1:]])


def _report(words: Sequence[str], status: str, error: str) -> None:
    """Print an error as a JSON object if --json is among the words of the command line."""
    if "--json" in words:
        print_json({"status": status, "error": error})
