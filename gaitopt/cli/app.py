"""The command line: one thin command per verb."""

import errno
import sys
from collections.abc import Sequence
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
    pareto_command,
    run_command,
    setup,
    solving,
    studies,
    trace_command,
    walking,
)
from gaitopt.cli.collection import collect_rarely
from gaitopt.cli.command import Command, CommandGroup
from gaitopt.cli.output import INTERRUPTED, err, print_json
from gaitopt.errors import GaitoptError, InputError, ScriptError
from gaitopt.interrupts import record_interrupts

_REFUSALS = {errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENOTDIR, errno.ENOSPC, errno.EROFS}
"""Errors of the operating system that concern the path of a user, not gaitopt."""

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
    run_command.run,
    studies.search,
    studies.sweep,
    pareto_command.pareto,
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
    with record_interrupts() as interrupt, collect_rarely():
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


def _explain(error: Exception, words: Sequence[str]) -> int:
    """Print an error of the input in one sentence and return the exit status; raise any other error."""
    if isinstance(error, GaitoptError):
        _report(words, "error", str(error))
        err.print(Text.assemble(("Error:", "red"), f" {error}"), soft_wrap=True)
        return 2
    if (fact := _describe_system_error(error)) is not None:
        return _explain(InputError(fact), words)
    if not (hasattr(error, "exit_code") and hasattr(error, "show") and hasattr(error, "format_message")):
        raise error
    _report(words, "error", error.format_message())  # a usage error of the command-line parser
    error.show()
    return int(error.exit_code)


def _describe_system_error(error: Exception) -> str | None:
    """Return a sentence on a file that the operating system refuses, or on memory; None for any other error."""
    if isinstance(error, MemoryError):
        return "The memory is insufficient for this command."
    if isinstance(error, OSError) and isinstance(error.filename, str) and error.errno in _REFUSALS:
        return f"Cannot read or write {error.filename:.200}: {error.strerror}."
    return None


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
