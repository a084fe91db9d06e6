"""The command on branches of gaits over a parameter."""

import contextlib
import functools
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import attrs
import typer

from gaitopt.cli.engine_advice import EngineAdvice, engine_for_walks
from gaitopt.cli.law_option import OPEN_LOOP, find_feedback
from gaitopt.cli.options import (
    EngineName,
    GainValues,
    Json,
    LawName,
    Quiet,
    RobotScript,
    Setting,
    Source,
    StanceAngle,
    TorqueLimit,
    TraceStarts,
    Verbose,
)
from gaitopt.cli.output import err
from gaitopt.cli.progress_display import Display, show_progress
from gaitopt.errors import InputError
from gaitopt.interrupts import record_interrupts

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from gaitopt.cli.inputs import Request
    from gaitopt.cli.trace_output import FailedTrace, TraceProgress
    from gaitopt.continuation.branch_diagram import BranchDiagram, GaitBranch
    from gaitopt.continuation.checkpoint import Checkpoint
    from gaitopt.continuation.gait_source import AnyCycle, AnyWalkProblem
    from gaitopt.continuation.special_curve import SpecialCurve
    from gaitopt.continuation.tracing import TraceOptions
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

SecondRange = Annotated[
    str | None,
    typer.Option(
        "--second",
        metavar="NAME=FROM:TO",
        help="Second parameter, with which the special points of the first branch are followed as curves.",
    ),
]
DiagramOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="NC/HTML/PNG/PDF/SVG",
        help="File of the diagram (.nc), of a page on which a click on a point plays its gait (.html), or of a figure.",
    ),
]
OptimalPoints = Annotated[
    int, typer.Option("--points", min=2, help="Number of equally spaced values of the parameter, for optimal gaits.")
]
ReplayInterval = Annotated[
    int,
    typer.Option("--replay", min=0, metavar="N", help="Replay every N-th optimal gait; 0 for none."),
]
OptimalSequences = Annotated[
    list[str] | None,
    typer.Option("--sequences", metavar="SEQUENCE,...", help="Further contact sequences of optimal gaits to follow."),
]
Neighbours = Annotated[
    bool,
    typer.Option(
        "--neighbours",
        help="Also follow optimal gaits of the neighbouring sequences where a contact mode is about to change.",
    ),
]
LONGEST_SILENCE = 6.0
"""Longest time between two lines of progress if standard error is not a terminal [s]."""


Over = Annotated[
    str,
    typer.Option(
        "--over",
        metavar="NAME=FROM:TO",
        help="Parameter of robot or ground, or gain of the law, and its range. Parameters of the script have the "
        "same units as with --set; all others are in SI units and rad. The results are in SI units and rad.",
    ),
]


class TraceInputs(NamedTuple):
    """A walking problem, the axis in SI units, the start of a saved gait, and the unit in which the axis was typed."""

    problem: "AnyWalkProblem"
    axis: dict[str, tuple[float, float]]
    start: "AnyCycle | None"
    unit: str
    factor: float = 1.0
    """Typed value per value in SI units."""


def trace(
    source: Source,
    over: Over,
    second: SecondRange = None,
    setting: Setting = None,
    doublings: Annotated[
        int, typer.Option(min=0, max=8, help="Number of successive branches of doubled period to follow.")
    ] = 0,
    deflate: Annotated[
        bool,
        typer.Option("--deflate", help="Also search for further gaits at both ends and in the middle of the range."),
    ] = False,
    output: DiagramOutput = None,
    points: OptimalPoints = 50,
    replay: ReplayInterval = 1,
    sequences: OptimalSequences = None,
    neighbours: Neighbours = False,
    starts: TraceStarts = 32,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    problem: RobotScript = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Follow a gait as a parameter varies, through folds, period doublings and changes of the contact sequence.

    For a script, the trace begins with its first stable gait at FROM (or, if none is stable, with an unstable one); a
    saved gait is followed in both directions from the value of the parameter in its file, with its planned torques or
    under --law. Optimal gaits over a parameter are followed for robots with one foot on the ground at a time only;
    robots with several contacts are accepted in saved gaits, and in scripts whose gaits, passive or controlled, are
    found by simulation without optimisation (PlanarWalkProblem).

    Ctrl-C ends the trace and keeps the branches that were followed. With -o FILE.nc, the trace is also kept in
    FILE.nc.checkpoint while it runs; the same command continues an interrupted trace from there.

    A script with an optimal-control problem is solved at FROM, and the optimum is followed with its active constraints;
    --sequences names further contact sequences to follow. Such a trace has no checkpoint: after an interrupt, the same
    command begins again.

    Exit status 0 if the trace is complete, 1 if an error ended it or no gait was found, 130 if it was interrupted.

    Example: gaitopt trace problems/compass_passive.py --over slope=1:5 --doublings 3 -o branches.nc
    """
    from gaitopt.cli.inputs import Request
    from gaitopt.cli.trace_optimum_command import states_optimum, trace_optima
    from gaitopt.cli.trace_output import report_diagram
    from gaitopt.continuation.tracing import TraceOptions
    from gaitopt.study.storage.study_lock import lock_study

    began, feedback = time.perf_counter(), find_feedback(law, gain, torque_limit, stance_angle)
    request = Request(source=source, settings=setting or [], script=problem, engine=engine, feedback=feedback)
    with contextlib.nullcontext() if output is None else lock_study(output):
        if request.is_script and states_optimum(request):
            choices = points, replay, sequences, neighbours
            trace_optima(request, (over, second), choices, output, json=json, quiet=quiet)
            return
        options = TraceOptions(doublings=doublings, deflate=deflate, starts=starts)
        with _open_checkpoint(request, (over, second), options, output, hidden=json or quiet) as checkpoint:
            options = attrs.evolve(options, checkpoint=checkpoint)
            diagram, failure = _follow(request, (over, second), options, json=json, quiet=quiet)
            if checkpoint is not None and diagram.complete:
                checkpoint.delete()
        problem_of, seconds = functools.partial(_find_problem, request, over), time.perf_counter() - began
        report_diagram(diagram, output, problem_of, doublings=doublings, seconds=seconds, failure=failure, json=json)


def _open_checkpoint(
    request: "Request", ranges: tuple[str, str | None], options: "TraceOptions", output: Path | None, *, hidden: bool
) -> "AbstractContextManager[Checkpoint | None]":
    """Return the checkpoint beside the output; none without a dataset."""
    import hashlib

    from gaitopt.cli.trace_output import TABLE
    from gaitopt.continuation.checkpoint import SUFFIX, Checkpoint

    if output is None or output.suffix.lower() != TABLE:
        return contextlib.nullcontext()
    if not request.source.is_file():
        return contextlib.nullcontext()  # which is reported when it is read
    digest = hashlib.sha256(request.source.read_bytes()).hexdigest()
    facts: dict[str, Any] = {"source": digest, "settings": request.settings, "ranges": ranges, "engine": request.engine}
    facts |= {name: getattr(options, name) for name in ("doublings", "deflate", "starts")}
    facts["law"] = getattr(request.feedback, "keywords", None)
    checkpoint = Checkpoint(output.with_name(output.name + SUFFIX), facts)
    if checkpoint.stored and not hidden:
        err.print(f"Resuming from {checkpoint.path.name}, with {checkpoint.stored} corrector steps.", soft_wrap=True)
    return checkpoint


def _follow(
    request: "Request", ranges: tuple[str, str | None], options: "TraceOptions", *, json: bool, quiet: bool
) -> tuple["BranchDiagram", "FailedTrace | None"]:
    """Return the diagram, and the unexpected error after which it is not complete, if there is one."""
    from gaitopt.cli.trace_output import FailedTrace

    try:
        with show_progress("tracing", hidden=json, longest=LONGEST_SILENCE) as display:
            return _trace_request(request, ranges, options, display, hidden=json or quiet), None
    except FailedTrace as failure:
        return failure.diagram, failure


def _trace_request(
    request: "Request", ranges: tuple[str, str | None], options: "TraceOptions", display: Display, *, hidden: bool
) -> "BranchDiagram":
    """Return the diagram over the first range, with curves over the second one if there is one."""
    from gaitopt.cli.trace_output import TraceProgress

    over, second = ranges
    other = None if second is None else _trace_inputs(request, second, hidden=True, option="--second").axis
    advice, request = EngineAdvice(hidden=hidden), _choose_engine(request, hidden=hidden)
    inputs = _trace_inputs(request, over, hidden=hidden)
    walk, axis, start = inputs.problem, inputs.axis, inputs.start
    progress = TraceProgress(display, next(iter(axis)), inputs.unit, inputs.factor)
    engine = _find_engine(request.engine, walk)
    advice.give(engine)
    options = attrs.evolve(options, engine=engine)
    if start is not None and not start.stable and not hidden:
        err.print(f"The saved gait is unstable (spectral radius {start.radius:.4g}).", soft_wrap=True)
    diagram = _trace(walk, axis, start, options, progress)
    if start is None and not all(branch.stable[0] for branch in diagram.branches[:1]) and not hidden:
        err.print("The trace begins with an unstable gait; more --starts may find a stable one.", soft_wrap=True)
    if other is None or not diagram.complete:
        return diagram
    return _trace_curves(walk, diagram, other, options, display)


def _trace(
    problem: "AnyWalkProblem",
    axis: dict[str, tuple[float, float]],
    start: "AnyCycle | None",
    options: "TraceOptions",
    progress: "TraceProgress",
) -> "BranchDiagram":
    """Return the diagram; after a Ctrl-C, with the branches followed until then and the part of the last one.

    Raises
    ------
    FailedTrace
        With the same branches, after any other exception.
    """
    from gaitopt.cli.trace_output import FailedTrace
    from gaitopt.continuation.tracing import make_diagram, trace_branches

    branches, latest = list["GaitBranch"](), list["GaitBranch"]()
    progress.display.describe("searching for a gait" if start is None else "tracing")

    def observe(branch: "GaitBranch") -> None:
        latest[:] = [branch]
        points = sum(other.values.size for other in branches) + branch.values.size
        progress.show_branch(len(branches), points)

    try:
        with record_interrupts() as interrupt:
            for branch in trace_branches(
                problem, axis, start=start, options=options, observer=observe, work_observer=progress.show_work
            ):
                branches.append(branch)
                latest.clear()
    except (KeyboardInterrupt, Exception) as error:
        if not branches and not latest:
            raise
        diagram = make_diagram(problem, axis, [*branches, *latest], complete=False)
        if isinstance(error, Exception) and not interrupt.received:
            raise FailedTrace(error, diagram, f"branch {len(branches)}", progress.place) from error
        return diagram
    return make_diagram(problem, axis, branches)


def _trace_curves(
    problem: "AnyWalkProblem",
    diagram: "BranchDiagram",
    second: dict[str, tuple[float, float]],
    options: "TraceOptions",
    display: Display,
) -> "BranchDiagram":
    """Return a diagram with curves of the special points of its first branch; if it ends early, like :func:`_trace`."""
    from gaitopt.cli.trace_output import FailedTrace
    from gaitopt.continuation.two_parameters import trace_curve

    curves = list["SpecialCurve"]()

    def observe(curve: "SpecialCurve") -> None:
        display.describe(
            f"curve {len(curves) + 1} ({curve.kind.label}), {len(curve.values)} point{'s' * (len(curve.values) != 1)}"
        )

    try:
        with record_interrupts() as interrupt:
            for number in range(len(diagram.branches[0].special)):
                curves.append(trace_curve(problem, diagram, second, special=number, options=options, observer=observe))
    except (KeyboardInterrupt, Exception) as error:
        part = replace(diagram, curves=tuple(curves), complete=False)
        if isinstance(error, Exception) and not interrupt.received:
            raise FailedTrace(error, part, f"curve {len(curves) + 1}") from error
        return part
    return replace(diagram, curves=tuple(curves))


def _trace_inputs(request: "Request", over: str, *, hidden: bool, option: str = "--over") -> TraceInputs:
    """Return the walking problem, the axis, and the start of a saved gait; announce the range."""
    import numpy as np

    from gaitopt.cli.axis import convert_axes, refuse_script_parameter, unconverted_axes
    from gaitopt.cli.inputs import read_walk
    from gaitopt.cli.script import any_walk_problem, read_script
    from gaitopt.continuation.parameter_values import check_range, gains_of, law_of, unit_of

    name, ends = read_range(over, option)
    if not request.is_script:
        walk, cycle = read_walk(request)
        check_range(walk, name, ends)
        return _announce_range(TraceInputs(walk, {name: ends}, cycle, unit_of(walk.robot, name)), hidden=hidden)
    if request.script is not None or request.feedback is not None:
        _ = request.problem  # which rejects both for a script
    script = read_script(request.source, request.settings)
    problem = any_walk_problem(script)
    known = [each.name for each in problem.robot.parameters] + list(gains_of(law_of(problem)))
    refuse_script_parameter(script, name, known)
    axes = {name: np.array(ends)}
    low, high = convert_axes(script, problem, axes)[name].tolist()
    check_range(problem, name, (low, high))  # before anything is printed
    note = unconverted_axes(script, problem, axes)
    if note and not hidden:
        err.print(note, soft_wrap=True)
    unit, factor = unit_of(problem.robot, name), 1.0
    if unit == "rad" and np.allclose(np.rad2deg((low, high)), ends):
        unit, factor = "deg", float(np.rad2deg(1.0))
    return _announce_range(TraceInputs(problem, {name: (low, high)}, None, unit, factor), hidden=hidden)


def _announce_range(inputs: TraceInputs, *, hidden: bool) -> TraceInputs:
    """Print the range in the unit in which it was typed, unless it is hidden, and return the inputs."""
    inputs = inputs._replace(unit="" if inputs.unit == "1" else inputs.unit)
    if not hidden:
        ((name, ends),) = inputs.axis.items()
        low, high = (f"{end * inputs.factor:g}" for end in ends)
        err.print(f"{name} from {low} to {high} {inputs.unit}".rstrip(), soft_wrap=True)
    return inputs


def read_range(text: str, option: str) -> tuple[str, tuple[float, float]]:
    """Return name and ends of a range ``NAME=FROM:TO``."""
    name, _, ends = text.partition("=")
    try:
        low, high = (float(end) for end in ends.split(":"))
    except ValueError:
        raise InputError(f"{option} must have the form NAME=FROM:TO, got {text!r}.") from None
    return name.strip(), (low, high)


def _choose_engine(request: "Request", *, hidden: bool) -> "Request":
    """Return the request with the engine of the walks of a saved gait of a robot with several contacts."""
    from gaitopt.motion.planar_gait import PlanarGait

    if request.is_script or not isinstance(request.gait, PlanarGait) or request.feedback is None:
        return request
    law = request.feedback(request.gait, request.gait.robot)
    engine = engine_for_walks(request.gait, law, request.engine, hidden=hidden)
    return request if engine is None else replace(request, engine=engine.name)


def _find_engine(name: str, problem: "AnyWalkProblem") -> "Engine | PlanarEngine":
    """Return the engine of a walking problem."""
    from gaitopt.control.law import passive
    from gaitopt.simulation.engine_choice import engine_named, planar_engine_named
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    if isinstance(problem, PlanarWalkProblem):
        return planar_engine_named(name)
    return engine_named(name, problem.law or passive(problem.robot), problem.robot)


def _find_problem(request: "Request", over: str) -> "AnyWalkProblem":
    """Return the walking problem that is traced."""
    return _trace_inputs(request, over, hidden=True).problem
