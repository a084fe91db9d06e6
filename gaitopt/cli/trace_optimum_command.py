"""The command on branches for a script with an optimal-control problem: branches of optimal gaits."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.axis import convert_axes, unconverted_axes
from gaitopt.cli.output import INTERRUPTED, err, out, print_json, report_file
from gaitopt.cli.progress_display import Display, show_progress
from gaitopt.cli.script import Script, gait_problem, read_script
from gaitopt.cli.trace_output import FailedTrace
from gaitopt.errors import InputError
from gaitopt.interrupts import record_interrupts
from gaitopt.motion.printable import format_count
from gaitopt.ocp.problem import GaitProblem

if TYPE_CHECKING:
    from gaitopt.cli.inputs import Request
    from gaitopt.continuation.optimal.optimal_branch import OptimalBranch, OptimalDiagram
    from gaitopt.continuation.optimal.optimum_tracing import OptimumOptions
    from gaitopt.simulation.engine import Engine

TABLE = ".nc"
"""Suffix of the file of a diagram; all others are figures."""


def states_optimum(request: "Request") -> bool:
    """Return whether the script of a request states an optimal-control problem."""
    return isinstance(request.stated, GaitProblem)


def trace_optima(
    request: "Request",
    ranges: tuple[str, str | None],
    choices: tuple[int, int, list[str] | None, bool],
    output: Path | None,
    *,
    json: bool,
    quiet: bool,
) -> None:
    """Follow the optimal gaits of a script and report their branches.

    Parameters
    ----------
    request : Request
    ranges : (str, str or None)
        Values of ``--over`` and ``--second``.
    choices : (int, int, list of str or None, bool)
        Values of ``--points``, ``--replay``, ``--sequences`` and ``--neighbours``.
    output : Path, optional
    json, quiet : bool
    """
    from gaitopt.cli.studies import split_sequences
    from gaitopt.cli.trace_command import read_range
    from gaitopt.continuation.optimal.optimum_tracing import OptimumOptions

    began, (points, replay, sequences, neighbours) = time.perf_counter(), choices
    if ranges[1] is not None or request.feedback is not None:
        option = "--second" if ranges[1] is not None else "--law"
        raise InputError(f"{option} is not accepted for branches of optimal gaits; the script states a GaitProblem.")
    if output is not None and output.suffix.lower() == ".html":
        raise InputError(f"Branches of optimal gaits are written as .nc, .png, .pdf or .svg, not as {output.name!r}.")
    further = tuple(sequence for text in sequences or [] for sequence in split_sequences(text))
    engine = None if request.engine == "auto" else engine_of(request)
    options = OptimumOptions(points=points, replay=replay, sequences=further, neighbours=neighbours, engine=engine)
    script = read_script(request.source, request.settings)
    facts = dict[str, object]()
    try:
        with show_progress("tracing", hidden=json) as display:
            diagram = trace_script(script, *read_range(ranges[0], "--over"), options, display, hidden=json or quiet)
    except FailedTrace as failure:
        diagram, facts["error"] = failure.diagram, f"{failure} {failure.advise()}"
    report_optima(diagram, output, json=json, facts=facts | {"seconds": time.perf_counter() - began})


def engine_of(request: "Request") -> "Engine":
    """Return the engine of the replays that a request names."""
    from gaitopt.control.law import passive
    from gaitopt.simulation.engine_choice import engine_named

    problem = gait_problem(read_script(request.source, request.settings))
    return engine_named(request.engine, passive(problem.robot), problem.robot)


def trace_script(
    script: Script, name: str, ends: tuple[float, float], options: "OptimumOptions", display: Display, *, hidden: bool
) -> "OptimalDiagram":
    """Return the branches of the optimal gaits of a script; after a Ctrl-C, those followed until then.

    Any other exception after the first gait raises FailedTrace, with the same branches.

    Parameters
    ----------
    script : Script
        States a GaitProblem.
    name : str
        The parameter or limit of the problem that varies.
    ends : (float, float)
        Its range, in the unit of the script's parameter of this name if it has one.
    options : OptimumOptions
    display : Display
    hidden : bool
        Whether notes are not printed.
    """
    from gaitopt.continuation.optimal.optimum_tracing import OptimumTracer

    problem = gait_problem(script)
    axes = {name: np.array(ends)}
    note = unconverted_axes(script, problem, axes)
    if note and not hidden:
        err.print(note, soft_wrap=True)
    low, high = convert_axes(script, problem, axes)[name].tolist()
    branches, latest = list["OptimalBranch"](), list["OptimalBranch"]()

    def observe(branch: "OptimalBranch") -> None:
        latest[:] = [branch]
        points = sum(other.values.size for other in branches) + branch.values.size
        display.describe(f"branch {len(branches)}, {format_count(points, 'gait')}, {name} = {branch.values[-1]:.6g}")

    tracer = OptimumTracer(problem, {name: (low, high)}, options, observe)
    try:
        with record_interrupts() as interrupt:
            for branch in tracer.trace(None):
                branches.append(branch)
                latest.clear()
    except (KeyboardInterrupt, Exception) as error:
        if not branches and not latest:
            raise
        diagram = tracer.make_diagram([*branches, *latest], complete=False)
        if isinstance(error, Exception) and not interrupt.received:
            place = f"{name} = {[*branches, *latest][-1].values[-1]:.6g}"
            raise FailedTrace(error, diagram, f"branch {len(branches)}", place) from error
        return diagram
    return tracer.make_diagram(branches)


def report_optima(diagram: "OptimalDiagram", path: Path | None, *, json: bool, facts: dict[str, object]) -> None:
    """Write a diagram to its file, and print it as tables or, with further facts, as JSON.

    If it is not complete, the command ends with 1 after an error, which is one of the facts, and otherwise with 130.
    """
    if path is not None:
        _write(diagram, path)
    if json:
        print_json(diagram.records() | {"file": None if path is None else str(path)} | facts)
    else:
        print_optima(diagram)
        if path is not None:
            report_file(path)
    if "error" in facts:
        err.print(Text.assemble(("Error:", "red"), f" {facts['error']}"), soft_wrap=True)
        sys.exit(1)
    if not diagram.complete:
        err.print("Interrupted; the branches followed so far are reported.")
        sys.exit(INTERRUPTED)  # not typer.Exit, which an interrupt of any other command becomes


def _write(diagram: "OptimalDiagram", path: Path) -> None:
    """Write a diagram as a dataset or as a figure."""
    from gaitopt.continuation.optimal.optimal_file import save_optima

    if path.suffix.lower() == TABLE:
        save_optima(diagram, path)
        return
    from gaitopt.plot.optimum_figure import plot_optima
    from gaitopt.plot.saving import save_figure

    save_figure(plot_optima(diagram), path)


def print_optima(diagram: "OptimalDiagram") -> None:
    """Print branches, their special points in order, and the contact sequences of lowest cost."""
    unit = "" if diagram.unit in ("", "1") else f" [{diagram.unit}]"
    parameter = Text(f"{diagram.parameter}{unit}")
    branches = Table(box=box.SIMPLE, pad_edge=False, title="branches of optimal gaits", title_justify="left")
    counted = ("gaits", "minima", "replays passed", "stable")
    for column in ("branch", "sequence", *counted, parameter, "cost", "begins", "ends"):
        branches.add_column(column, no_wrap=True)
    for number, branch in enumerate(diagram.branches):
        begin = branch.begin if branch.parent is None else f"branch {branch.parent}"
        replayed = f"{int(branch.passed.sum())} of {int(branch.replayed.sum())}"
        counts = (str(branch.values.size), str(int(branch.minimum.sum())), replayed, str(int(branch.stable.sum())))
        span = f"{branch.values[0]:.6g} to {branch.values[-1]:.6g}" if branch.values.size else ""
        cost = f"{branch.costs.min():.6g} to {branch.costs.max():.6g}" if branch.values.size else ""
        ends = (begin.replace("_", " "), branch.end.replace("_", " "))
        branches.add_row(str(number), Text(branch.sequence), *counts, span, cost, *ends)
    out.print(branches)
    special = Table(box=box.SIMPLE, pad_edge=False, title="special points", title_justify="left")
    for column in ("branch", "kind", parameter, "cost", "constraint"):
        special.add_column(column, no_wrap=column != "constraint")
    for number, branch in enumerate(diagram.branches):
        for point in branch.special:
            special.add_row(
                str(number), point.label, f"{point.value:.10f}", f"{point.cost:.8g}", Text(point.constraint)
            )
    if special.row_count:
        out.print(special)
    for border in diagram.borders:
        names = [f"'{name}'" if name else "no gait found" for name in (border.before, border.after)]
        out.print(
            Text(f"lowest cost: {names[0]} below {diagram.parameter} = {border.value:.10g}, {names[1]} above"),
            soft_wrap=True,
        )
