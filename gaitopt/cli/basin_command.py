"""The command on basins of attraction."""

import functools
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from gaitopt.cli.law_option import OPEN_LOOP, find_feedback
from gaitopt.cli.options import (
    BasinAxes,
    BasinOutput,
    EngineName,
    GainValues,
    Json,
    LawName,
    Quiet,
    Scheduler,
    Setting,
    StanceAngle,
    State,
    TorqueLimit,
    Verbose,
    Workers,
)
from gaitopt.cli.output import err, exit_incomplete, out, print_json, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.settings import read_numbers
from gaitopt.cli.workers import WorkerOptions, worker_options
from gaitopt.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from gaitopt.cli.axis import Problem
    from gaitopt.cli.inputs import CommandInput, Request
    from gaitopt.motion.motion import Array
    from gaitopt.parallel.execution import TaskObserver
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

MOST_STARTS = 10_000_000
"""Largest grid of a basin: it takes 600 MB."""
BasinInput = Annotated[
    Path,
    typer.Argument(metavar="PROBLEM.py|FILE", help="Problem script, gait file, or diagram of 'gaitopt trace' (.nc)."),
]
OriginalProblem = Annotated[
    Path | None,
    typer.Option(
        "--problem",
        metavar="PROBLEM.py|FILE",
        help="Script that defines the robot, if the gait file does not contain it; for a diagram, the script or gait "
        "file from which it was traced.",
    ),
]
BranchNumber = Annotated[
    int | None,
    typer.Option("--branch", min=0, help="Number of the branch of a diagram (.nc).", show_default="0"),
]
STEPS = 100
"""Maximum number of steps of a walk by default."""


def basin(
    source: BasinInput,
    over: BasinAxes,
    setting: Setting = None,
    state: State = None,
    steps: Annotated[int, typer.Option(min=2, max=100000, help="Maximum number of steps of a walk.")] = STEPS,
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: BasinOutput = None,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    problem: OriginalProblem = None,
    branch: BranchNumber = None,
) -> None:
    """Simulate walks from every start of a grid and report the gait in which each ends, or how it fails.

    For a saved gait, walks use its torques or the given feedback law; the fraction of starts that return to the gait is
    also reported.  A coordinate of the start without an axis has the value stated by --state, otherwise that of the
    saved gait.  For a script it has the value of the first periodic gait that is found if there is a single axis and
    no --state, and otherwise 0.  The file of results contains these values.

    For a robot with several contacts, a start is completed from the gait of the file or of the script: coordinates and
    rates that are not stated differ from those of the gait as little as possible while its feet stand on the ground.

    For a diagram of 'gaitopt trace -o FILE.nc', the walks start from states in a ball around each gait of one branch
    at the given values of its parameter.  For each gait, the smallest push after which the walker does not return to
    it (fatal push) is reported.

    The command may be interrupted: with an output file, the same command resumes the computation; for a diagram, it
    begins again.

    Example: gaitopt basin problems/rimless_wheel.py --over theta_rate=0.1:3:200 -o basin.nc
    """
    from gaitopt.cli.diagram_basin import DIAGRAM, compute_diagram_basin
    from gaitopt.cli.inputs import Request
    from gaitopt.cli.planar_basin import compute_gait_share, find_planar_basin, read_planar_subject
    from gaitopt.simulation.engine_choice import planar_engine_named

    began, feedback = time.perf_counter(), find_feedback(law, gain, torque_limit, stance_angle)
    if source.suffix == DIAGRAM or branch is not None:
        unaccepted = {"--law": law != OPEN_LOOP, "--gain": gain, "--stance-angle": stance_angle, "--set": setting}
        unaccepted |= {"--torque-limit": torque_limit is not None, "--steps": steps != STEPS, "--state": state}
        stated = unaccepted | {"--workers": workers, "--scheduler": scheduler}
        compute_diagram_basin((source, problem, branch or 0), over, engine, output, stated, json=json)
        return
    request = Request(source=source, settings=setting or [], script=problem, engine=engine, feedback=feedback)
    if (planar := read_planar_subject(request)) is None:
        subject, axes, base = _basin_inputs(request, over, state, hidden=json or quiet)
    else:
        axes = _axes_of(request, over, hidden=json or quiet)
        base = _read_start(state, axes)
    with worker_options(workers, scheduler) as team, show_progress("basin", hidden=json, counted="starts") as display:
        if planar is None:
            result = _find_basin(request, subject, axes, base, steps, output, team, display.count)
        else:
            options = _options(request, steps, output, team, display.count)
            options["engine"], choice = planar_engine_named(engine), (law, gain or [], torque_limit, stance_angle)
            result = find_planar_basin(planar, choice, axes, base, **options)
    used = subject.engine if planar is None else planar_engine_named(engine)
    share = _share_of_gait(request, subject, result) if planar is None else compute_gait_share(result, planar)
    _report(result, (used, share), output, json=json, seconds=time.perf_counter() - began)
    if not result.attrs["complete"]:
        exit_incomplete("basin", output)


def _report(
    table: "xr.Dataset",
    used: tuple["Engine | PlanarEngine", float | None],
    path: Path | None,
    *,
    json: bool,
    seconds: float,
) -> None:
    """Print a basin, with its engine and the share of a saved gait, as a table or as JSON."""
    from gaitopt.cli.walk_output import basin_facts, print_basin
    from gaitopt.study.basins.basin_file import basin_key

    if json:
        print_json(basin_facts(table, *used) | {"file": path and str(path), "seconds": seconds})
        return
    print_basin(table, *used)
    gait = basin_key(table)["method"].get("gait", {})  # of a robot with several contacts
    _warn_outside({str(name): table[name].values for name in table.ending.dims}, gait, hidden=out.quiet)
    if path is not None and table.attrs["complete"]:
        report_file(path)


def _basin_inputs(
    request: "Request", over: list[str], state: list[str] | None, *, hidden: bool
) -> tuple["CommandInput", dict[str, "Array"], dict[str, float]]:
    """Return the walker of a basin, its axes in SI units, and the other coordinates of the starts."""
    from gaitopt.cli.inputs import read_input
    from gaitopt.simulation.engine_choice import faster_walks
    from gaitopt.stability.cycle_search import STARTS
    from gaitopt.stability.start import choose_start

    axes = _axes_of(request, over, hidden=hidden)
    # A gait completes the start if fewer than two axes and no coordinate are given.
    subject = read_input(request, STARTS if not state and len(axes) < 2 else 0, first=True)
    note = faster_walks(subject.engine)
    if note and not hidden:
        err.print(note, soft_wrap=True)
    base = _read_start(state, axes)
    if subject.cycle is not None:
        base = choose_start(subject.robot, subject.robot.vector(subject.parameters), base, subject.cycle)
        _warn_outside(axes, subject.cycle.state, hidden=hidden)
    return subject, axes, {name: value for name, value in base.items() if name not in axes}


def _warn_outside(axes: "Mapping[str, Array]", state: Mapping[str, float], *, hidden: bool) -> None:
    """Print a warning if a periodic gait is outside the axes of a basin, with its state [SI, rad]."""
    outside = [name for name, values in axes.items() if name in state and not min(values) <= state[name] <= max(values)]
    if outside and not hidden:
        place = ", ".join(f"{name} = {state[name]:.4g}" for name in outside)
        err.print(f"warning: the periodic gait is outside the axes: {place} [SI, rad]", soft_wrap=True)


def _read_start(state: list[str] | None, axes: "Mapping[str, Array]") -> dict[str, float]:
    """Return the values of --state; raise InputError if one of them is also an axis."""
    base = read_numbers(state, "--state")
    for name in base:
        if name in axes:
            raise InputError(f"{name} is set by both --over and --state; use only one of them.")
    return base


def _axes_of(request: "Request", over: list[str], *, hidden: bool) -> dict[str, "Array"]:
    """Return the axes of a basin in SI units."""
    from gaitopt.cli.axis import convert_axes, grid, unconverted_axes
    from gaitopt.cli.planar_gait_walk import is_planar_gait
    from gaitopt.cli.script import read_script

    axes = grid(over, MOST_STARTS)
    if not request.is_script:
        return axes
    script = read_script(request.source, request.settings)
    problem = cast("Problem", request.stated if is_planar_gait(request.stated) else request.problem)
    axes = convert_axes(script, problem, axes)
    note = unconverted_axes(script, problem, axes)
    if note and not hidden:
        err.print(note, soft_wrap=True)
    return axes


def _options(
    request: "Request", steps: int, path: Path | None, team: WorkerOptions, observer: "TaskObserver"
) -> dict[str, Any]:
    """Return the options of a basin that do not depend on the robot."""
    from gaitopt.cli.script import load_script
    from gaitopt.study.basins.attractor import SettlingCriterion

    prepare = functools.partial(load_script, request.source.resolve()) if request.is_script else None
    execution = team.execution(observer, prepare)
    return {"criterion": SettlingCriterion(steps=steps), "execution": execution, "path": path}


def _find_basin(
    request: "Request",
    subject: "CommandInput",
    axes: dict[str, "Array"],
    base: dict[str, float],
    steps: int,
    path: Path | None,
    team: WorkerOptions,
    observer: "TaskObserver",
) -> "xr.Dataset":
    """Return the basin of a walker, computed or continued from a file."""
    from gaitopt.study.basins.basin import basin as find_basin

    return find_basin(
        subject.robot,
        {name: value for name, value in {**base, **subject.parameters}.items() if name not in axes},
        axes,
        law=subject.law,
        engine=subject.engine,
        **_options(request, steps, path, team, observer),
    )


def _share_of_gait(request: "Request", subject: "CommandInput", table: "xr.Dataset") -> float | None:
    """Return the share of the starts that end in a saved gait; None for a script, or if parameters vary."""
    from gaitopt.stability.section import Section
    from gaitopt.study.basins.basin_file import fraction_at

    if request.is_script or subject.cycle is None or any(name in subject.parameters for name in table.ending.dims):
        return None
    names = Section(subject.robot, subject.robot.vector(subject.parameters), sliding=True).names
    return fraction_at(table, subject.cycle.state, names)
