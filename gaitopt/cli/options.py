"""Arguments and options that several commands share, and those that every command has."""

import functools
import inspect
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.cli.output import err, out
from gaitopt.errors import InputError
from gaitopt.motion.versions import versions

GaitFile = Annotated[Path, typer.Argument(metavar="FILE", help="A gait written by 'gaitopt solve'.")]
Script = Annotated[Path, typer.Argument(metavar="PROBLEM.py", help="A problem script.")]
RobotScript = Annotated[
    Path | None,
    typer.Option("--problem", metavar="PROBLEM.py", help="Script with the robot, for one not in the catalogue."),
]
Setting = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter of the script.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no table.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Versions, what an iteration found, and seconds, on standard error.")
]


def labelled(files: Sequence[Path]) -> dict[str, Path]:
    """Return files by what tells them apart: their names without suffix, whole paths where these are alike.

    Raises
    ------
    InputError
        If one is named twice.
    """
    stems = [file.stem for file in files]
    found = {file.stem if stems.count(file.stem) == 1 else str(file): file for file in files}
    if len(found) < len(files):
        raise InputError("The same gait file is named twice.")
    return found


def with_common_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command with ``--quiet`` and ``--verbose``, which work in all commands alike.

    A command that has such a parameter of its own is told, to hide or show its progress.
    """
    signature = inspect.signature(command)
    shared = {"quiet": Quiet, "verbose": Verbose}
    added = {name: kind for name, kind in shared.items() if name not in signature.parameters}

    @functools.wraps(command)
    def spoken(**given: Any) -> None:
        quiet, verbose = given.get("quiet", False), given.get("verbose", False)
        former, out.quiet, began = out.quiet, quiet, time.perf_counter()
        if verbose:
            err.print(", ".join(f"{name} {version}" for name, version in versions().items()), soft_wrap=True)
        try:
            command(**{name: value for name, value in given.items() if name not in added})
        finally:
            out.quiet = former
            if verbose:
                err.print(f"gaitopt {command.__name__} took {time.perf_counter() - began:.3f} s")

    parameters = [
        inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD, default=False, annotation=kind)
        for name, kind in added.items()
    ]
    spoken.__signature__ = signature.replace(parameters=[*signature.parameters.values(), *parameters])  # type: ignore[attr-defined]
    spoken.__annotations__ = {**command.__annotations__, **added}
    return spoken
