"""The command line: one thin command per verb."""

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from gaitopt import __version__
from gaitopt.cli import commands
from gaitopt.cli.output import err, print_json
from gaitopt.errors import GaitoptError

app = typer.Typer(
    name="gaitopt",
    help="Optimal-control gait design for planar walking with foot slippage.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode="rich",
)
for command in (
    commands.solve,
    commands.show,
    commands.verify,
    commands.plot,
    commands.animate,
    commands.problems,
):
    app.command()(command)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.", is_eager=True)] = False,
) -> None:
    if version:
        typer.echo(__version__)
        raise typer.Exit


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status: 0 success, 1 no verified solution, 2 a mistake."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        status = app(given, prog_name="gaitopt", standalone_mode=False) or 0
    except GaitoptError as error:
        if "--json" in given:
            print_json({"status": "error", "error": str(error)})
        err.print(f"[red]Error:[/] {_escaped(error)}", soft_wrap=True)
        status = 2
    except (KeyboardInterrupt, typer.Abort):
        err.print("Interrupted; nothing was written.")
        status = 128 + signal.SIGINT
    except typer.Exit as stop:
        status = stop.exit_code
    except Exception as error:
        if not hasattr(error, "exit_code") or not hasattr(error, "show"):
            raise
        error.show()  # a usage error of the command-line parser
        status = error.exit_code
    sys.exit(status)


def run_script(path: str) -> None:
    """Solve the problem of a script that is run as ``python SCRIPT``; further arguments are those of ``solve``."""
    main(["solve", str(Path(path)), *sys.argv[1:]])


def _escaped(error: Exception) -> str:
    return str(error).replace("[", r"\[")
