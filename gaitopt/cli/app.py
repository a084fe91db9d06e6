"""The command line: one thin command per verb."""

import errno
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.address_space import lacks_memory
from gaitopt.cli.collection import collect_rarely
from gaitopt.cli.command import Command, CommandGroup
from gaitopt.cli.output import INTERRUPTED, err, print_json
from gaitopt.cli.stored_results import Invocation, describe_interrupt
from gaitopt.errors import GaitoptError, InputError, NoGaitError, ScriptError
from gaitopt.interrupts import Handler, InterruptRecord, interrupt_on_termination, record_interrupts
from gaitopt.motion.atomic import record_writes

_REFUSALS = {errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENOTDIR, errno.ENOSPC, errno.EROFS}
"""Errors of the operating system that concern the path of a user, not gaitopt."""

MODULES = {
    "new": "setup",
    "solve": "solving",
    "show": "solving",
    "verify": "verify_command",
    "design": "design_command",
    "plot": "exporting",
    "animate": "exporting",
    "report": "exporting",
    "export": "exporting",
    "problems": "listing",
    "simulate": "walking",
    "stability": "walking",
    "trace": "trace_command",
    "impact": "impact_command",
    "tune": "feedback",
    "push": "push_command",
    "basin": "basin_command",
    "run": "run_command",
    "search": "studies",
    "sweep": "studies",
    "pareto": "pareto_command",
    "compare": "studies",
    "audit": "audit_command",
    "doctor": "setup",
}
"""Module of each command, in the order of the help; a command line that names one imports no other."""


def import_commands(words: Sequence[str]) -> list[Callable[..., None]]:
    """Return the functions of the command that a command line names first, or of all commands."""
    names = words[:1] if words and words[0] in MODULES else MODULES
    return [getattr(import_module(f"gaitopt.cli.{MODULES[name]}"), name) for name in names]


def build_app(commands: Iterable[Callable[..., None]]) -> typer.Typer:
    """Return the command line with some commands."""
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
    for command in commands:
        app.command(cls=Command)(command)
    app.callback(invoke_without_command=True)(_version)
    return app


def __getattr__(name: str) -> typer.Typer:
    """Return ``app``, the command line with all commands, which is built when it is first used."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()["app"] = app = build_app(import_commands(()))
    return app


def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    if version:
        from gaitopt.version import __version__

        typer.echo(__version__)
        raise typer.Exit


def main(arguments: Sequence[str] | None = None, handler: Handler | None = None) -> None:
    """Run the command line and exit with its status: 0 success, 1 no verified solution, 2 invalid input.

    A handler replaces the present one of Ctrl-C while the command runs.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    invocation, written = Invocation(), list[Path]()
    try:
        with (
            record_interrupts(handler) as interrupt,
            interrupt_on_termination(),
            collect_rarely(),
            record_writes(written),
        ):
            status = _run(words, invocation, interrupt)
    except KeyboardInterrupt:  # between two statements of the lines above
        status = INTERRUPTED
    if status == INTERRUPTED:
        with record_interrupts(lambda number, frame: None):  # further interrupts must not replace the message
            message = describe_interrupt(invocation, written)
            _report(words, "interrupted", message)
            err.print(message, soft_wrap=True)
    sys.exit(status)


def _run(words: list[str], invocation: Invocation, interrupt: InterruptRecord) -> int:
    """Run the command line and return its status; the errors of the input and interrupts are explained."""
    try:
        app = build_app(import_commands(words))
        return app(words, prog_name="gaitopt", standalone_mode=False, obj=invocation) or 0
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED
    except Exception as error:
        explained = isinstance(error, GaitoptError) and not isinstance(error, ScriptError)
        caused = interrupt.received and (not explained or _is_import_error(error))
        return INTERRUPTED if caused else _explain(error, words)


def _is_import_error(error: BaseException | None) -> bool:
    """Return whether an error has an ImportError among its causes, as after an interrupt of an import."""
    while error is not None and not isinstance(error, ImportError):
        error = error.__cause__ or error.__context__
    return error is not None


def _explain(error: Exception, words: Sequence[str]) -> int:
    """Print an error of the input in one sentence and return the exit status; raise any other error."""
    if isinstance(error, GaitoptError):
        from rich.text import Text

        place = "".join(f" ({note})" for note in getattr(error, "__notes__", ()))
        _report(words, "error", f"{error}{place}")
        err.print(Text.assemble(("Error:", "red"), f" {error}", (place, "dim")), soft_wrap=True)
        return 1 if isinstance(error, NoGaitError) else 2
    if (fact := _describe_system_error(error)) is not None:
        return _explain(InputError(fact), words)
    if not (hasattr(error, "exit_code") and hasattr(error, "show") and hasattr(error, "format_message")):
        raise error
    _add_setting_hint(error)
    _report(words, "error", error.format_message())  # a usage error of the command-line parser
    error.show()
    return int(error.exit_code)


def _add_setting_hint(error: Any) -> None:
    """Add to the message of an unknown option how a parameter of a script is changed, if the command has --set."""
    option, context = getattr(error, "option_name", None), getattr(error, "ctx", None)
    if option is None or context is None or getattr(error, "possibilities", None):
        return
    name = option.lstrip("-")
    if len(name) > 1 and any("--set" in parameter.opts for parameter in context.command.params):  # not a short option
        error.message += f". A parameter of a problem script is changed by --set {name}=VALUE."


def _describe_system_error(error: Exception) -> str | None:
    """Return a sentence on a file that the operating system refuses, or on memory; None for any other error."""
    if lacks_memory(error):
        return (
            "The memory is insufficient for this command: free some memory, or use fewer workers or a smaller problem."
        )
    if isinstance(error, OSError) and isinstance(error.filename, str) and error.errno in _REFUSALS:
        return f"Cannot read or write {error.filename:.200}: {error.strerror}."
    return None


def report_thread_error(lost: "threading.ExceptHookArgs") -> None:
    """Print an error of another thread; if it is due to insufficient memory, the command states it."""
    if lost.exc_value is None or not lacks_memory(lost.exc_value):
        threading.__excepthook__(lost)


def run_script(path: str) -> None:
    """Solve the problem of a script that is run as ``python SCRIPT``; further arguments are those of ``solve``."""
    main(["solve", str(Path(path)), *sys.argv[1:]])


def run_design(path: str) -> None:
    """Solve the design of a script that is run as ``python SCRIPT``; further arguments are those of ``design``."""
    main(["design", str(Path(path)), *sys.argv[1:]])


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
