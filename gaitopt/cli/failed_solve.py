"""Failed solves: their reason in one line, and their files, written by `gaitopt solve` and solved again by it."""

import itertools
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.output import err, out
from gaitopt.dataclass import dataclass
from gaitopt.errors import ArchiveError, InputError
from gaitopt.motion.atomic import GAIT_SUFFIXES
from gaitopt.ocp.problem import GaitProblem
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem


@dataclass(frozen=True)
class FailureFile:
    """The file of a failed solve.

    Attributes
    ----------
    path : Path or None
        None if it could not be written.
    reason : str
        Reason why it was not written, or why it does not suffice to repeat the solve; empty without any.
    """

    path: Path | None
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class SolveCommand:
    """The files and settings of a `gaitopt solve`, from which those of a solve without a result follow.

    Attributes
    ----------
    source : Path
        Problem script, or file of a failed solve.
    settings : sequence of str
        ``NAME=VALUE``.
    guess, output : Path or None

    Examples
    --------
    >>> command = SolveCommand(source=Path("walk.py"), settings=["friction=0.2"])
    >>> command.continue_from(Path("walk_interrupted.h5"))
    'gaitopt solve walk.py --set friction=0.2 --guess walk_interrupted.h5'
    """

    source: Path
    settings: Sequence[str] = ()
    guess: Path | None = None
    output: Path | None = None

    @property
    def repeats(self) -> bool:
        """Whether the source is the file of a failed solve."""
        return is_gait_file(self.source)

    @property
    def result(self) -> Path:
        """The file of the gait."""
        return self.output or Path(f"{self.source.stem}{'_solved' if self.repeats else ''}.h5")

    def failure(self, status: Status) -> Path:
        """Return the file of a solve without a result: FILE_failed.h5, after an interrupt FILE_interrupted.h5.

        A number is appended if this file is an input of the command.
        """
        result = self.output or Path(f"{self.source.stem}.h5")
        stem = f"{result.stem}_{'interrupted' if status is Status.INTERRUPTED else 'failed'}"
        names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
        inputs = {file.resolve() for file in (self.source, self.guess) if file is not None}
        return next(path for name in names if (path := result.with_name(f"{name}.h5")).resolve() not in inputs)

    def remedy(self, number: int) -> Path:
        """Return the file of the gait of a tested remedy, counted from 1."""
        result = self.output or Path(f"{self.source.stem}.h5")
        return result.with_name(f"{result.stem}_remedy_{number}.h5")

    def continue_from(self, iterate: Path) -> str:
        """Return the command that starts from an iterate."""
        words = [word for setting in self.settings for word in ("--set", setting)] + ["--guess", str(iterate)]
        words += [] if self.output is None else ["-o", str(self.output)]
        return shlex.join(["gaitopt", "solve", str(self.source), *words])


def state_failure(gait: "AnyGait") -> str:
    """Return the status of a gait that is not a verified solution, with the reason, in one line."""
    from gaitopt.motion.gait import IMPLAUSIBLE, NONEXISTENT
    from gaitopt.study.storage.failure_reason import explain_failure

    reason = explain_failure(gait) or "it was not verified"
    is_final = any(part in reason for part in (gait.status.hint, IMPLAUSIBLE, NONEXISTENT))
    remedy = "" if is_final else f". {gait.status.hint}"
    return f"{gait.status.key}: {reason.removesuffix('.') if remedy else reason}{remedy}"


def is_gait_file(path: Path) -> bool:
    """Return whether the input of a solve is a file of a gait, not a script."""
    return path.suffix.lower() in GAIT_SUFFIXES


def read_failed_problem(path: Path, settings: Sequence[str] | None) -> "tuple[GaitProblem | PlanarProblem, Any]":
    """Return the problem in the file of a failed solve, and the record of its script.

    Raises
    ------
    ArchiveError
        If the file is unreadable.
    InputError
        If settings are given, or the file does not contain the problem.
    """
    from gaitopt.motion.archive import load
    from gaitopt.ocp.problem_definition import restore_problem

    if settings:
        raise InputError(f"--set changes a parameter of a script, and {path} is not a script ending in .py.")
    gait = load(path)
    if gait.status.ok:
        raise InputError(f"{path} is a solved gait; 'gaitopt solve' repeats failed solves and solves scripts.")
    return restore_problem(gait), gait.problem.get("script")


def write_failure(gait: "AnyGait", problem: "GaitProblem | PlanarProblem", path: Path) -> FailureFile:
    """Write a gait that is not a solution, with the definition of its problem."""
    from gaitopt.motion.archive import save
    from gaitopt.ocp.problem_definition import KEY, REASON, record_definition

    if KEY not in gait.problem:  # solved, but not verified
        gait = record_definition(gait, problem)
    try:
        return FailureFile(save(gait, path), gait.problem[KEY].get(REASON, ""))
    except (ArchiveError, InputError) as error:
        return FailureFile(None, str(error))


def report_iterate(gait: "AnyGait", failure: FailureFile | None, command: SolveCommand) -> None:
    """Print what was written of an interrupted solve, and the command that continues from it; also with ``--quiet``."""
    from gaitopt.motion.gait import BEFORE_REFINEMENT

    if failure is None or failure.path is None:
        text = f"Interrupted; no result was written{'' if failure is None else f': {failure.reason}'}"
    else:
        proceed = command.continue_from(failure.path)
        if gait.solver.message.endswith(BEFORE_REFINEMENT):
            text = f"the solution on the last grid, which is not refined. To continue from it: {proceed}"
        elif gait.solver.message.endswith("the best feasible one"):
            text = f"{gait.solver.message.partition('; the result is ')[2]}. To continue from it: {proceed}"
        else:
            text = (
                f"the last iterate, which is not a solution. A new solve is usually the better choice; to start from "
                f"the iterate: {proceed}"
            )
        text = f"Interrupted; wrote {failure.path} with {text}"
    (err if out.quiet else out).print(text, soft_wrap=True)


def report_failure(failure: FailureFile | None, repeated: Path | None = None) -> None:
    """Print what was written of a solve without a result, or that the repeated file contains its problem."""
    if failure is None and repeated is not None:
        text = f"nothing was written: {repeated} already contains this problem, whose solve fails again"
    elif failure is None:
        text = "nothing was written"
    elif failure.path is None:
        text = f"nothing was written: {failure.reason}"
    elif failure.reason:
        text = (
            f"wrote {failure.path} with its last iterate. To repeat the solve, the script is needed: {failure.reason}"
        )
    else:
        text = f"wrote {failure.path}. To repeat the solve: gaitopt solve {failure.path}"
    out.print(f"no verified gait was found; {text}", soft_wrap=True)
