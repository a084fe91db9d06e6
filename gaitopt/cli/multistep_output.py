"""Gaits of several steps on the command line: solved from a script, or read from their file."""

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.output import out, print_json, print_reason, report_file, verdict_text
from gaitopt.cli.progress_display import Display, show_progress
from gaitopt.errors import ArchiveError, InputError, join_reasons
from gaitopt.motion.printable import format_count
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
    from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
    from gaitopt.progress import HomotopyIteration, Iteration


def is_multistep_problem(problem: object) -> bool:
    """Return whether a script has returned a problem of several steps."""
    from gaitopt.ocp.problem import GaitProblem

    if isinstance(problem, GaitProblem):
        return False
    from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem

    return isinstance(problem, MultiStepProblem)


def is_multistep_file(path: Path) -> bool:
    """Return whether a file contains a gait of several steps; a missing or damaged one is left to its reader."""
    from gaitopt.motion.hdf5 import identify_file

    try:
        return str(identify_file(path)["kind"]) == "gait of several steps"
    except ArchiveError:
        return False


def solve_multistep(problem: "MultiStepProblem", path: Path, *, guess: Path | None, json: bool) -> Status:
    """Solve a problem of several steps, replay the gait, and write and print it; return its status.

    Raises
    ------
    InputError
        If a guess is named: each step states its own.
    """
    from gaitopt.motion.atomic import check_gait_suffix, check_writable
    from gaitopt.ocp.multistep.multistep_file import save_steps
    from gaitopt.ocp.multistep.multistep_solver import solve_steps
    from gaitopt.simulation.multistep_verification import verify_steps

    if guess is not None:
        raise InputError(
            f"--guess is not accepted for a problem of several steps, got {guess}; state the guess of each step in the "
            "script, as guess=... of its GaitProblem."
        )
    check_gait_suffix(path)
    check_writable(path)
    with show_progress(f"{problem.name}: building", hidden=json) as display:
        gait = solve_steps(problem, observer=functools.partial(_describe_iteration, display))
        if gait.status.ok:
            display.describe("replaying in the event-driven simulator")
            gait = verify_steps(gait)
    written = save_steps(gait, path) if gait.status.ok else None
    _print_status(gait.status)
    if json:
        print_json(gait.summarise() | {"file": None if written is None else str(written)})
        return gait.status
    print_multistep(gait)
    if written:
        report_file(written)
    else:
        out.print("no verified gait was found; nothing was written")
    return gait.status


def _describe_iteration(display: Display, step: "Iteration | HomotopyIteration") -> None:
    display.describe(f"iteration {step.number:3d}   objective {step.objective:.6f}")


def verify_multistep(path: Path, output: Path | None, *, json: bool) -> Status:
    """Replay the gait in a file, write it to the output, if there is one, and print the result; return its status."""
    from gaitopt.cli.verify_command import report_replay
    from gaitopt.ocp.multistep.multistep_file import load_steps, save_steps
    from gaitopt.simulation.multistep_verification import verify_steps

    gait = verify_steps(load_steps(path))
    if output is not None:
        save_steps(gait, output)
    if json:
        print_json(gait.summarise() | {"file": str(output or path)})
    else:
        print_multistep(gait)
        report_replay(output)
    _print_status(gait.status)
    return gait.status


def _print_status(status: Status) -> None:
    """Print the status of a gait that is not a solution if ``--quiet`` hides its table."""
    if not status.ok:
        print_reason(f"{status.key}: {status.hint}")


def multistep_facts(gait: "MultiStepGait") -> dict[str, Any]:
    """Return the facts of a gait of several steps."""
    return gait.summarise()


def print_multistep(gait: "MultiStepGait") -> None:
    """Print the facts of a gait of several steps and a table of its steps."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from gaitopt.motion.gait_table import name_objective

    out.print(f"{gait.problem.name}: {gait.status.key}, {gait.message}, {format_count(gait.iterations, 'iteration')}")
    name = name_objective(*(step.objective.name for step in gait.problem.steps))
    out.print(f"{name}: {gait.objective:.6g}")
    table = Table(box=box.SIMPLE, pad_edge=False)
    columns = {
        "friction": "friction",
        "slope [deg]": "slope",
        "rise [m]": "rise",
        "length [m]": "step_length",
        "duration [s]": "duration",
        name: "objective",
    }
    if gait.problem.terrain is None:
        del columns["rise [m]"]
    for column in ("step", "sequence", *columns):
        table.add_column(column, no_wrap=True)
    for number, facts in enumerate(gait.summarise()["steps"]):
        shown = facts | {"slope": math.degrees(facts["slope"])}
        numbers = (f"{float(shown[name]):.4g}" for name in columns.values())
        table.add_row(str(number), facts["sequence"], *numbers)
    out.print(table)
    replay = gait.verification
    if replay is not None:
        reasons = "" if replay.passed else f": {join_reasons(replay.reasons)}"
        verdict = verdict_text("passed" if replay.passed else "failed", replay.passed)
        difference = f", the state differs from the plan by up to {replay.state_error:.1e}{reasons}"
        out.print(Text.assemble("replay: ", verdict, difference))
