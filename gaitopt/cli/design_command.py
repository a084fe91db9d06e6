"""The command on design: parameters of a walker optimised with one gait or a family of gaits."""

import math
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.options import LAWS, Json, Quiet, ScriptFile, Setting, Verbose
from gaitopt.cli.output import INTERRUPTED, err, out, print_json, print_reason, report_file, verdict_text
from gaitopt.cli.output_files import create_folder, describe_earlier
from gaitopt.cli.progress_display import Display, show_progress
from gaitopt.cli.robust_design import design_robust
from gaitopt.errors import InputError
from gaitopt.motion.printable import format_count
from gaitopt.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gaitopt.design.family_gaits import FamilyGaits
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.problem import GaitProblem
    from gaitopt.ocp.provenance import ScriptRecord
    from gaitopt.progress import HomotopyIteration, Iteration

LAW_VALUES = f"{', '.join(LAWS)}, feedforward, or SCRIPT.py:FUNCTION"

NOT_SOLVED = "not all gaits are solved and verified; nothing was written"

BOUND_TOLERANCE = 1e-6
"""Distance from a bound, relative to the range of a parameter, at which the parameter is at its bound."""


def design(
    script: ScriptFile,
    setting: Setting = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Folder of the gait files.", show_default="SCRIPT"),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(metavar="LAW", help=f"Law of a RobustProblem instead of that of the script: {LAW_VALUES}."),
    ] = None,
    count: Annotated[
        int, typer.Option(min=1, help="Number of unseen scenarios, and of pushes, in the test of a RobustProblem.")
    ] = 20,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Optimise parameters of a walker together with its gaits, or plan a robust gait; replay and save the gaits.

    The script returns a Family, a GaitProblem or a PlanarProblem with free parameters, or a RobustProblem.  A
    Family and a RobustProblem consist of gaits of robots with one foot on the ground at a time (GaitProblem).  For a
    RobustProblem, one gait and one law are planned for ranges of parameters and for pushes; the additional cost and
    the numbers of survived scenarios are reported, and the gains of the law are saved for 'gaitopt push --law'.

    Exit status 0 if all gaits are solved and verified, or the robust plan survives all candidate scenarios and all
    unseen ones; 1 otherwise.

    Example: gaitopt design walker.py --set friction=0.2 -o walker
    """
    from gaitopt.cli.script import read_script
    from gaitopt.motion.archive import save
    from gaitopt.motion.atomic import check_writable

    source = read_script(script, setting)
    stated = _add_record(source(), source.record())
    folder, repeat = output or Path(script.stem), _repeat_command(script, setting, output, law)
    if (robust := _state_robust(stated, law)) is not None:
        design_robust(robust, folder, script.stem, count=count, repeat=repeat, json=json)
    paths = [folder / f"{script.stem}_{number}.h5" for number in range(1, _count_gaits(stated, script) + 1)]
    with create_folder(folder):
        for path in paths:
            check_writable(path)
        with show_progress(f"{stated.name}: building", hidden=json) as display:
            result = _solve(stated, display, verbose=verbose)
        ok = result.status.ok and all(gait.status.ok for gait in result.gaits)
        written = [save(gait, path) for gait, path in zip(result.gaits, paths, strict=True)] if ok else []
    if json:
        print_json(result.summarise() | {"files": [str(path) for path in written]})
    else:
        _print_family(result, _free_ranges(stated), worst_case=getattr(stated, "worst_case", False))
        for path in written:
            report_file(path)
        if not ok:
            if earlier := describe_earlier(paths):
                out.print(earlier, soft_wrap=True)
            out.print(f"{NOT_SOLVED}. To repeat the design: {repeat}", soft_wrap=True)
    if result.status is Status.INTERRUPTED:
        sys.exit(INTERRUPTED)  # the results already contain the status
    if not ok:
        _print_status(result)
    raise typer.Exit(0 if ok else 1)


def _repeat_command(script: Path, settings: list[str] | None, output: Path | None, law: str | None) -> str:
    """Return the command that repeats a design.

    Examples
    --------
    >>> _repeat_command(Path("walker.py"), ["friction=0.2"], None, "lqr")
    'gaitopt design walker.py --set friction=0.2 --law lqr'
    """
    words = [word for setting in settings or () for word in ("--set", setting)]
    words += [*(() if output is None else ("-o", str(output))), *(() if law is None else ("--law", law))]
    return shlex.join(["gaitopt", "design", str(script), *words])


def _print_status(result: "FamilyGaits") -> None:
    """Print the status of the first gait that is not solved."""
    failed = next((gait.status for gait in result.gaits if not gait.status.ok), result.status)
    print_reason(f"{failed.key}: {failed.hint}")


def _add_record(stated: Any, record: "ScriptRecord") -> Any:
    """Return what a script states with the record of the script in its problems."""
    from dataclasses import replace

    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.problem import GaitProblem

    if isinstance(stated, Family):
        return replace(stated, problems=[problem.replace(script=record) for problem in stated.problems])
    if isinstance(stated, RobustProblem):
        return replace(stated, problem=stated.problem.replace(script=record))
    return stated.replace(script=record) if isinstance(stated, GaitProblem | PlanarProblem) else stated


def _state_robust(stated: object, law: str | None) -> "RobustProblem | None":
    """Return the robust problem of a script with the law of --law; None for another problem, which accepts no --law."""
    from dataclasses import replace

    from gaitopt.design.robust_problem import RobustProblem

    if isinstance(stated, RobustProblem):
        return stated if law is None else replace(stated, law=law)
    if law is not None:
        raise InputError(
            f"--law is accepted for a RobustProblem only, and the script returns a {type(stated).__name__}."
        )
    return None


def _count_gaits(stated: object, script: Path) -> int:
    """Return the number of gaits that a script states; InputError unless it has free parameters."""
    from gaitopt.design.family import Family
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.problem import GaitProblem

    if isinstance(stated, Family):
        return len(stated.problems)
    kind = f"a {type(stated).__name__}"
    if isinstance(stated, GaitProblem | PlanarProblem):
        if stated.free_ranges:
            return 1
        kind += " without free parameters"
    raise InputError(
        f"problem() of {script} must return a Family, a RobustProblem, or a GaitProblem or a PlanarProblem with "
        f"free={{...}}; it returned {kind}."
    )


def _solve(stated: Any, display: Display, *, verbose: bool) -> "FamilyGaits":
    """Return the replayed gaits of a family, or of one problem."""
    from dataclasses import replace

    from gaitopt.design.family import Family
    from gaitopt.simulation.verification import verify

    def observe(step: "Iteration | HomotopyIteration") -> None:
        grid = getattr(step, "grid", "")  # steps of a homotopy have none
        text = f"iteration {step.number:3d}{grid}   objective {step.objective:.6f}"
        display.describe(text)
        if verbose:
            err.print(text)

    result = stated.solve(observer=observe) if isinstance(stated, Family) else _solve_one(stated, observe)
    display.describe("replaying in the event-driven simulator")
    gaits = tuple(verify(gait) if gait.status.ok else gait for gait in result.gaits)
    return replace(result, gaits=gaits)


def _solve_one(problem: "GaitProblem | PlanarProblem", observe: Any) -> "FamilyGaits":
    """Return the gait of one problem with free parameters."""
    from gaitopt.design.family_gaits import FamilyGaits
    from gaitopt.ocp.solver import solve

    gait: Any = solve(problem, observer=observe)
    return FamilyGaits(
        gaits=(gait,),
        design=gait.design,
        weights=(1.0,),
        objective=gait.solver.objective,
        status=gait.status,
        message=gait.solver.message,
        iterations=gait.solver.iterations,
        solve_seconds=gait.solver.solve_seconds,
    )


def _free_ranges(stated: Any) -> dict[str, tuple[float, float]]:
    """Return the bounds of the free parameters of a family or of one problem."""
    problem = stated.problems[0] if hasattr(stated, "problems") else stated
    return {name: (float(lower), float(upper)) for name, (lower, upper) in problem.free_ranges.items()}


def _describe_parameter(robot: "Robot | PlanarRobot", name: str, value: float, ends: tuple[float, float]) -> str:
    """Return a designed parameter with its unit, and whether it is at a bound.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> _describe_parameter(compass_biped(), "leg_com", 1.2, (0.4, 1.2))
    'leg_com 1.2 m (at its upper bound)'
    """
    unit = robot.parameters[robot.index(name)].unit
    near = BOUND_TOLERANCE * (ends[1] - ends[0])
    side = "lower" if value <= ends[0] + near else "upper" if value >= ends[1] - near else ""
    text = f"{name} {value:.6g}" + ("" if unit in ("", "1") else f" {unit}")
    return f"{text} (at its {side} bound)" if side else text


def _describe_objective(result: "FamilyGaits", worst_case: bool) -> str:
    """Return the objective with its kind; weights are divided by their sum, so a sum of objectives is their mean.

    With equal weights, the worst objective is that of a gait, not its share of the sum.
    """
    name = _name_objective(result)
    if len(result.gaits) == 1:
        return f"{name}: {result.objective:.6g}"
    equal = math.isclose(min(result.weights), max(result.weights))
    if not worst_case:
        return f"{name}: {result.objective:.6g}, the {'' if equal else 'weighted '}mean of the gaits"
    weighted = [weight * cost for weight, cost in zip(result.weights, result.costs, strict=True)]
    number = max(range(len(weighted)), key=weighted.__getitem__)
    if equal:
        return f"{name}: {result.costs[number]:.6g}, the largest of the gaits (gait {number + 1})"
    weight = result.weights[number]
    return f"{name}: {weighted[number]:.6g}, the largest weighted one (gait {number + 1}, weight {weight:.4g})"


def _name_objective(result: "FamilyGaits") -> str:
    """Return the name of the objective of the gaits."""
    from gaitopt.motion.gait_table import name_objective

    return name_objective(*(str(gait.problem["objective"]) for gait in result.gaits))


def _print_family(
    result: "FamilyGaits", ranges: "Mapping[str, tuple[float, float]]", *, worst_case: bool = False
) -> None:
    """Print the parameters, the objective and a table of the gaits."""
    from rich import box
    from rich.table import Table

    out.print(f"status: {result.status.key}, {result.message}, {format_count(result.iterations, 'iteration')}")
    if result.design:
        robot, unbounded = result.gaits[0].robot, (-math.inf, math.inf)
        texts = (_describe_parameter(robot, name, v, ranges.get(name, unbounded)) for name, v in result.design.items())
        out.print("design: " + ", ".join(texts))
    out.print(_describe_objective(result, worst_case))
    table = Table(box=box.SIMPLE, pad_edge=False)
    for column in (
        "gait",
        "sequence",
        "speed [m/s]",
        "step length [m]",
        "friction",
        "slope [deg]",
        _name_objective(result),
        "replay",
    ):
        table.add_column(column, no_wrap=True)
    for number, gait in enumerate(result.gaits, start=1):
        passed = gait.verification is not None and gait.verification.passed
        values = gait.motion.parameters
        table.add_row(
            str(number),
            str(gait.sequence),
            f"{gait.speed:.4g}",
            f"{gait.step_length:.4g}",
            f"{values['friction']:.4g}",
            f"{math.degrees(values['slope']):.4g}",
            f"{gait.solver.objective:.6g}",
            verdict_text("passed" if passed else gait.status.key, passed),
        )
    out.print(table)
