"""Commands on one problem and its gait: solve, show, verify."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gaitopt.cli.options import GaitFile, Json, Quiet, RobotScript, Script, Setting, Verbose
from gaitopt.cli.output import INTERRUPTED, err, homotopy_lines, out, print_gait, print_json, print_written
from gaitopt.progress import HomotopyIteration, Iteration
from gaitopt.status import Status


def solve(
    script: Script,
    setting: Setting = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Where to write the gait. [SCRIPT.h5]")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find an energy-optimal gait, replay it in the event-driven simulator, and save it.

    Exit status 0 for a solved and verified gait, 1 when there is none, 2 for a mistake in the input, 130 when
    interrupted.

    Example: gaitopt solve problems/compass_slip.py --set friction=0.2 -o slip.h5
    """
    from rich.markup import escape

    from gaitopt.cli.script import build_problem
    from gaitopt.motion.archive import check_gait_suffix, save
    from gaitopt.motion.atomic import check_writable
    from gaitopt.motion.summary import summarise
    from gaitopt.ocp.solver import solve as solve_problem
    from gaitopt.simulation.verification import verify as verify_gait

    problem = build_problem(script, setting or [])
    path = output or Path(f"{script.stem}.h5")
    check_gait_suffix(path)
    check_writable(path)  # before the work, not after it
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=json or quiet) as progress:
        task = progress.add_task(f"{escape(problem.name)}: building")

        def observe(step: Iteration | HomotopyIteration) -> None:
            if isinstance(step, HomotopyIteration):
                lines = homotopy_lines(step, problem.objective.name) if verbose or not (json or quiet) else []
                err.print(*lines, sep="\n", markup=False, end="\n" if lines else "")
                return
            text = (
                f"iteration {step.number:3d}   {problem.objective.name} {step.objective:.6f}   "
                f"infeasibility {step.infeasibility:.1e}"
            )
            progress.update(task, description=text)
            if verbose:
                err.print(text, markup=False)

        gait = solve_problem(problem, observer=observe)
        if gait.status.ok:
            progress.update(task, description="replaying in the event-driven simulator")
            gait = verify_gait(gait, problem.robot)
    written = save(gait, path) if gait.status.ok else None
    if json:
        print_json(summarise(gait) | {"file": None if written is None else str(written)})
    elif not quiet:
        print_gait(gait)
        if written:
            print_written(written)
        else:
            out.print("no verified gait; nothing was written")
    if gait.status is Status.INTERRUPTED:
        sys.exit(INTERRUPTED)  # what there is to say has been said
    raise typer.Exit(0 if gait.status.ok else 1)


def show(file: GaitFile, json: Json = False) -> None:
    """Show what a gait file holds.

    Example: gaitopt show compass_slip.h5 --json
    """
    from gaitopt.motion.archive import load
    from gaitopt.motion.summary import summarise

    gait = load(file)
    if json:
        print_json(summarise(gait) | {"file": str(file)})
    else:
        print_gait(gait)


def verify(
    file: GaitFile,
    problem: RobotScript = None,
    json: Json = False,
) -> None:
    """Replay a saved gait's torques in the event-driven simulator and compare with the plan.

    Exit status 0 if it passes, 1 if not.  The file is not changed.

    Example: gaitopt verify compass_slip.h5
    """
    from gaitopt.cli.script import robot_of
    from gaitopt.motion.archive import load
    from gaitopt.motion.summary import summarise
    from gaitopt.simulation.verification import verify as verify_gait

    gait = load(file)
    gait = verify_gait(gait, robot_of(gait, problem))
    if json:
        print_json(summarise(gait) | {"file": str(file)})
    else:
        print_gait(gait)
        out.print("replayed just now in the event-driven simulator; the file is as it was")
    passed = gait.verification is not None and gait.verification.passed
    raise typer.Exit(0 if passed and gait.status.ok else 1)
