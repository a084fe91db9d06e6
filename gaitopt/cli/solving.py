"""Commands on one problem and its gait: solve, show."""

import functools
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.background_import import BackgroundImport
from gaitopt.cli.options import (
    AngleUnit,
    GuessColumns,
    GuessFile,
    Json,
    Quiet,
    Setting,
    SolveSource,
    Verbose,
)
from gaitopt.cli.output import INTERRUPTED, err, homotopy_lines, out, print_json, print_reason, report_file
from gaitopt.cli.progress_display import Display, show_progress
from gaitopt.errors import InputError
from gaitopt.progress import HomotopyIteration, Iteration, SolveObserver
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.cli.remedy_files import RemedyFiles
    from gaitopt.motion.gait import Gait
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.problem import GaitProblem

GaitOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        help="File of the gait.",
        show_default="SCRIPT.h5, or FAILED_solved.h5 for FAILED.h5",
    ),
]

AFTER_THE_SOLVE = (
    "h5py",
    "gaitopt.control.law",
    "gaitopt.motion.planar_gait",
    "gaitopt.simulation.scipy_engine",
    "gaitopt.simulation.verification",
    "gaitopt.ocp.solution.certification",
    "gaitopt.motion.archive",
    "gaitopt.model.physics",
    "numpy.random",
)
"""Modules that `solve` needs when the gait is found; their import takes as long as a short solve."""

FAILURES = (Status.INFEASIBLE, Status.ITERATION_LIMIT, Status.FAILED, Status.DIVERGING, Status.PLAN_INACCURATE)
"""Statuses of a solve without a gait after which its remedies are tried."""

TABLE = ("gaitopt.cli.console", "gaitopt.cli.gait_output")
"""Modules of the table of a gait, which --quiet hides."""


def solve(
    source: SolveSource,
    setting: Setting = None,
    guess: GuessFile = None,
    column: GuessColumns = None,
    angle_unit: AngleUnit = None,
    output: GaitOutput = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find an optimal gait, replay it in the event-driven simulator, and save it.

    If no gait is found, SCRIPT_failed.h5 (with -o FILE.h5: FILE_failed.h5) is written, which contains robot and
    problem: gaitopt solve SCRIPT_failed.h5 repeats the solve without the script.  For a robot with several contacts,
    remedies are first tested by further solves.  After Ctrl-C, SCRIPT_interrupted.h5 contains the solution on
    the last grid, from which --guess continues, or an iterate.

    Exit status 0 for a solved and verified gait, 1 if none was found, 2 for invalid input, 130 after an interrupt.

    With --guess, the solve starts from a gait, or from a recorded motion whose columns are named as in the CSV files of
    gaitopt export, and the differences of its fit from the samples are reported.

    Example: gaitopt solve problems/compass_slip.py --set friction=0.2 -o slip.h5

    Example: gaitopt solve problems/compass_slip.py --guess walk.csv --column th1=stance --angle-unit deg
    """
    from gaitopt.cli.failed_solve import SolveCommand, state_failure
    from gaitopt.cli.guess_option import start_from_file
    from gaitopt.cli.multistep_output import is_multistep_problem, solve_multistep
    from gaitopt.cli.remedy_files import RemedyFiles
    from gaitopt.motion.atomic import check_gait_suffix, check_writable

    stated = SolveCommand(source=source, settings=setting or (), guess=guess, output=output)
    remedies = RemedyFiles(stated)
    problem, script = _read_problem(source, setting)
    if is_multistep_problem(problem):
        status = solve_multistep(problem, output or Path(f"{source.stem}.h5"), guess=guess, json=json)
        sys.exit(INTERRUPTED if status is Status.INTERRUPTED else 0 if status.ok else 1)
    problem, fit = start_from_file(problem, guess, column, angle_unit)
    check_gait_suffix(stated.result)
    check_writable(stated.result)  # before the work, not after it
    if fit is not None and not (json or quiet):
        out.print(str(fit), soft_wrap=True)
    for remark in _list_implausible(problem):
        err.print(f"warning: {remark}", soft_wrap=True)  # before the solve, which may take long and fails
    with show_progress(f"{problem.name}: building", hidden=json) as display:
        observer = _observer(display, problem.objective.name, verbose or not (json or quiet), verbose)
        gait = _solve_and_import(problem, observer, AFTER_THE_SOLVE if json or quiet else AFTER_THE_SOLVE + TABLE)
        gait = gait.replace_fields(problem={**gait.problem, "script": gait.problem.get("script") or script})
        interrupted = gait.status is Status.INTERRUPTED
        if gait.status.ok:
            gait, interrupted = _verify_and_certify(gait, display)
        elif not interrupted:
            gait, interrupted = _try_remedies(problem, gait, observer, display, remedies)
    interrupted |= _save_and_report(gait, problem, remedies, json=json)
    if interrupted:
        if gait.status is not Status.INTERRUPTED:
            err.print(_describe_interrupt(gait, stated.result), soft_wrap=True)
        sys.exit(INTERRUPTED)  # the results are in the table already
    if not gait.status.ok:
        print_reason(state_failure(gait))
        if guess is not None:
            text = f"The solve started from {guess}; without --guess it starts from the guess of the problem."
            err.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(0 if gait.status.ok else 1)


def _list_implausible(problem: "GaitProblem | PlanarProblem") -> tuple[str, ...]:
    """Return the sentences on implausible sizes and directions of the robot, limits of angles and soft touchdowns."""
    from gaitopt.model.robot import Robot

    if isinstance(problem.robot, Robot):
        from gaitopt.model.plausible_sizes import report_implausible_sizes
        from gaitopt.ocp.statement.limits import report_implausible_angles

        sizes = report_implausible_sizes(problem.robot, problem.values, problem.step_length_range.lower)
        return sizes + report_implausible_angles("Limits.angle", problem.limits.angle)
    from gaitopt.ocp.multicontact.planar_remarks import report_implausible_limits, report_implausible_robot
    from gaitopt.ocp.multicontact.possible_causes import report_soft_touchdowns

    soft = () if problem.sequence.is_open else report_soft_touchdowns(problem)
    return report_implausible_robot(problem, problem.values) + report_implausible_limits(problem) + soft


def _solve_and_import(
    problem: "GaitProblem | PlanarProblem", observer: SolveObserver, modules: Sequence[str]
) -> "Gait | PlanarGait":
    """Solve a problem, and import modules while the solver iterates."""
    from gaitopt.ocp.solver import solve as solve_problem

    with BackgroundImport(modules) as background:

        def observe(step: Iteration | HomotopyIteration) -> None:
            background.continue_import()
            observer(step)

        return solve_problem(problem, observer=observe)


def _read_problem(source: Path, settings: Sequence[str] | None) -> tuple[Any, Any]:
    """Return the problem of a script or of the file of a failed solve, and the record of its script."""
    from gaitopt.cli.failed_solve import is_gait_file, read_failed_problem
    from gaitopt.cli.multistep_output import is_multistep_problem
    from gaitopt.cli.script import read_script, require_optimal_problem

    if is_gait_file(source):
        return read_failed_problem(source, settings)
    called = read_script(source, settings)
    stated = called()
    problem = stated if is_multistep_problem(stated) else require_optimal_problem(stated, called)
    return problem, called.record().describe()


def _verify_and_certify(gait: "Gait | PlanarGait", display: Display) -> "tuple[Gait | PlanarGait, bool]":
    """Return a solved gait with its replay and its certificate; after an interrupt without the rest, and True."""
    from gaitopt.motion.robot_archive import serialise_robot
    from gaitopt.simulation.verification import verify as verify_gait

    try:
        display.describe("replaying in the event-driven simulator")
        gait.begin_evaluation("certificate")  # part of it is computed in another thread during the replay
        gait = verify_gait(gait)
        serialise_robot(gait)  # before the file is written, because the other thread may still be at work
        display.describe("checking the second-order conditions of the optimum")
        _ = gait.certificate
    except KeyboardInterrupt:
        return gait.without_certificate(), True
    return gait, False


def _try_remedies(
    problem: "GaitProblem | PlanarProblem",
    gait: "Gait | PlanarGait",
    observer: SolveObserver,
    display: Display,
    files: "RemedyFiles",
) -> "tuple[Gait | PlanarGait, bool]":
    """Return a failed solve, for several contacts with its tested remedies, and whether the test was interrupted."""
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.simulation.remedy_trials import try_remedies

    if not (isinstance(problem, PlanarProblem) and isinstance(gait, PlanarGait) and gait.status in FAILURES):
        return gait, False
    display.describe("no gait was found; testing remedies")
    try:
        return try_remedies(problem, gait, observer, keep=functools.partial(files.keep, problem)), False
    except KeyboardInterrupt:
        return gait, True


def _describe_interrupt(gait: "Gait | PlanarGait", path: Path) -> str:
    """Return what a command that was interrupted after its solve has not done."""
    if not gait.status.ok:
        return "Interrupted: possible remedies are not all tested."
    if gait.verification is None:
        solved = "the gait is solved but not verified"
        stored = shlex.join(["gaitopt", "verify", str(path), "-o", str(path.with_name(f"{path.stem}_verified.h5"))])
        return f"Interrupted before the end of the replay: {solved}. To replay it: {stored}"
    return "Interrupted: the gait is verified, but the second-order conditions of its optimum are not checked."


def _save_and_report(
    gait: "Gait | PlanarGait", problem: "GaitProblem | PlanarProblem", remedies: "RemedyFiles", *, json: bool
) -> bool:
    """Write and print a gait, or print why none exists and write the last iterate; return whether that was interrupted.

    The file of a failed solve that is repeated and fails again is not written again.
    """
    from gaitopt.cli.failed_solve import report_failure, report_iterate, write_failure
    from gaitopt.motion.archive import save
    from gaitopt.motion.summary import summarise

    interrupted, written, failed, command = False, None, None, remedies.command
    stopped = gait.status is Status.INTERRUPTED
    try:
        if gait.status.ok:
            written = command.result  # a Ctrl-C is raised when the file is written
            save(gait, written)
        elif stopped or not command.repeats:
            failed = write_failure(gait, problem, command.failure(gait.status))
    except KeyboardInterrupt:
        interrupted = True
    if json:
        files = {"file": written, "failure_file": failed and failed.path}
        facts = {name: None if file is None else str(file) for name, file in files.items()}
        print_json(summarise(gait) | facts | {"remedy_files": [str(file) for file in remedies.changes]})
    elif not out.quiet:
        from gaitopt.cli.gait_output import print_gait

        print_gait(gait)
        if written:
            report_file(written)
        elif not stopped:
            report_failure(failed, command.source if command.repeats else None)
            remedies.report()
    if stopped and not json:
        report_iterate(gait, failed, command)
    return interrupted


def _observer(display: Display, objective: str, steps: bool, iterations: bool) -> SolveObserver:
    """Return an observer that displays iterations; `steps` of a homotopy and `iterations` are printed on request."""

    def observe(step: Iteration | HomotopyIteration) -> None:
        if isinstance(step, HomotopyIteration):
            lines = homotopy_lines(step, objective) if steps else []
            err.print(*lines, sep="\n", end="\n" if lines else "")
            return
        numbers = f"{objective} {step.objective:.6f}   infeasibility {step.infeasibility:.1e}"
        text = f"iteration {step.number:3d}{step.grid}   {numbers}"
        display.describe(text)
        if iterations:
            err.print(text)

    return observe


def show(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="File of any result, folder of a search, or problem script.")
    ],
    setting: Setting = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Show the contents of a result file of any kind as a table, or the problem of a script in mathematical notation.

    For a script that assigns a robot to a variable and has no problem(), or whose problem() returns a robot, its
    coordinates, equations of motion, contact law and parameters are shown.

    Example: gaitopt show compass_slip.h5 --json

    Example: gaitopt show problems/compass_slip.py --set friction=0.2
    """
    from gaitopt.cli.result_output import find_facts, print_result
    from gaitopt.study.result_file import load_result

    if file.suffix == ".py":
        show_script(file, setting, json=json)
        return
    if setting:
        raise InputError(f"--set changes a parameter of a script, and {file} is not a script ending in .py.")
    result = load_result(file)
    if json:
        print_json(find_facts(result) | {"file": str(file)})
    else:
        print_result(result)


def show_script(script: Path, settings: Sequence[str] | None, *, json: bool) -> None:
    """Print the problem that a script states, or the robot of a walk or of a script without a problem."""
    from gaitopt.cli.walk_script import describe_robot, read_problem_or_robot
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
    from gaitopt.ocp.problem import GaitProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    problem = read_problem_or_robot(script, settings)
    if isinstance(problem, GaitProblem | PlanarProblem | MultiStepProblem | Family | RobustProblem):
        facts = problem.describe()
    elif isinstance(problem, Robot | PlanarRobot):
        facts = describe_robot(problem)
    elif isinstance(problem, WalkProblem | PlanarWalkProblem):
        facts = {"name": problem.name, "robot": problem.robot.name, **problem.parameters}
    else:
        raise InputError(
            "'gaitopt show' shows a GaitProblem, PlanarProblem, MultiStepProblem, Family, RobustProblem, WalkProblem, "
            f"PlanarWalkProblem or a robot; problem() of {script} returned {type(problem).__name__}."
        )
    if json:
        print_json(facts | {"file": str(script)})
    else:
        out.print(str(problem), markup=False, highlight=False, soft_wrap=True)
