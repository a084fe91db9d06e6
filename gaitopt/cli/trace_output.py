"""Output of the command on branches of gaits."""

import math
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.output import INTERRUPTED, err, out, print_json, report_file
from gaitopt.cli.progress_display import Display
from gaitopt.cli.stored_results import describe_stored_results
from gaitopt.continuation.branch_diagram import BranchDiagram, GaitBranch, count_steps, name_sides
from gaitopt.continuation.following import FollowingWork
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint
from gaitopt.motion.printable import format_count

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitopt.continuation.gait_source import AnyWalkProblem

TABLE, PAGE = ".nc", ".html"
"""Suffix of the file of a diagram, and of a page on which its gaits are played; all others are figures."""

USUAL_WIDTH = 80
"""Characters in a line of most terminals."""


class TraceProgress:
    """Display of the branch that is followed.

    Parameters
    ----------
    display : Display
    name : str
        Parameter.
    unit : str
        Unit in which it was typed.
    factor : float
        Typed value per value in SI units.

    Attributes
    ----------
    place : str
        Value of the parameter at which the latest work begins; empty before.
    """

    def __init__(self, display: Display, name: str, unit: str, factor: float) -> None:
        self.display, self._name, self._unit, self._factor = display, name, unit, factor
        self._branch, self._gaits, self.place = 0, 0, ""

    def show_branch(self, branch: int, gaits: int) -> None:
        """Set the number of the branch that is followed, and of all gaits so far."""
        self._branch, self._gaits = branch, gaits

    def show_work(self, work: FollowingWork) -> None:
        """Show the work that begins."""
        self.place = f"{self._name} = {work.value * self._factor:.6g} {self._unit}".rstrip()
        text = (
            f"branch {self._branch}, {format_count(self._gaits, 'gait')}, {self.place}, arclength {work.arclength:.3g}"
        )
        self.display.describe(f"{text}: {work.name}" if work.name else text)


class FailedTrace(Exception):
    """An unexpected error that ended a trace after some gaits.

    Parameters
    ----------
    error : Exception
    diagram : BranchDiagram or OptimalDiagram
        Branches followed before the error.
    work : str
        The branch or curve that was followed.
    place : str
        Value of the parameter, as text.
    """

    def __init__(self, error: Exception, diagram: Any, work: str, place: str = "") -> None:
        frames = traceback.extract_tb(error.__traceback__)
        source = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
        super().__init__(
            f"The trace ended on {work}{f', near {place}' if place else ''}, with {type(error).__name__}: "
            f"{str(error).removesuffix('.')}{source}. The branches followed before are reported."
        )
        self.diagram, self.place = diagram, place

    def advise(self, resumption: str = "") -> str:
        """Return how to continue, beginning with how the trace is resumed if it can be."""
        if not self.place:
            return resumption
        return f"{resumption} If the error recurs, trace a range that ends before {self.place}.".lstrip()


def print_diagram(diagram: BranchDiagram, doublings: int = 0) -> None:
    """Print branches, and their special points in order; state that a requested branch of doubled period is missing."""
    out.print(_branch_table(diagram))
    special = _special_table(diagram)
    if special.row_count:
        out.print(special)
    if diagram.curves:
        out.print(_curve_table(diagram))
    if doublings and diagram.complete and not any(b.special_of("period_doubling") for b in diagram.branches):
        out.print("The branches have no period doubling, so --doublings has no effect.")
    if diagram.ratios:
        ratios = ", ".join(f"{ratio:.4f}" for ratio in diagram.ratios)
        out.print(f"ratios of the distances between period doublings: {ratios}")


def report_diagram(
    diagram: BranchDiagram,
    path: Path | None,
    problem_of: "Callable[[], AnyWalkProblem]",
    *,
    doublings: int,
    seconds: float,
    failure: FailedTrace | None,
    json: bool,
) -> None:
    """Write a diagram to its file, and print it as a table or as JSON; if it is not complete, end with its status."""
    if path is not None:
        _write(diagram, path, problem_of)
    if json:
        error = {} if failure is None else {"error": str(failure)}
        file = {"file": None if path is None else str(path)}
        print_json(diagram.records() | file | {"seconds": seconds} | error)
    else:
        print_diagram(diagram, doublings)
        if path is not None:
            report_file(path)
    if not diagram.complete:
        _exit_incomplete(failure, path)


def _exit_incomplete(failure: FailedTrace | None, path: Path | None) -> NoReturn:
    """Report why a diagram is not complete and how the trace is resumed; end with 1 after an error, otherwise 130."""
    resumption = _describe_resumption(path)
    if failure is not None:
        err.print(Text.assemble(("Error:", "red"), f" {failure} {failure.advise(resumption)}"), soft_wrap=True)
        sys.exit(1)
    err.print(f"Interrupted; the branches followed so far are reported. {resumption}", soft_wrap=True)
    sys.exit(INTERRUPTED)  # not typer.Exit, which an interrupt of any other command becomes


def _branch_table(diagram: BranchDiagram) -> Table:
    """Return the table of the branches."""
    table = _make_table("branches")
    parameters = _name_parameter(diagram)
    titles = ["branch", "steps", "gaits\n(stable)", *parameters, "begins", "ends"]
    for title in titles:
        table.add_column(Text(title), no_wrap=title in titles[:3], overflow="fold")
    for number, branch in enumerate(diagram.branches):
        ends = branch.values[[0, -1]]
        spans = ["{:.6g} to {:.6g}".format(*each) for each in (ends, np.rad2deg(ends))[: len(parameters)]]
        counts = (str(branch.steps), f"{branch.values.size} ({int(branch.stable.sum())})")
        reasons = _name_begin(diagram, branch), _name_end(branch.end, branch.special[-1:])
        table.add_row(str(number), *counts, *spans, *reasons)
    return table


def _special_table(diagram: BranchDiagram) -> Table:
    """Return the table of the special points."""
    table = _make_table("special points")
    parameters = _name_parameter(diagram)
    for title in ("branch", "kind", *parameters, "stability", "contact sequence"):
        table.add_column(Text(title), no_wrap=title in ("branch", *parameters), overflow="fold")
    for number, branch in enumerate(diagram.branches):
        for point in branch.special:
            sides = name_sides(point.before, point.after)[: 1 + (point.after != point.before)]
            names = [count_steps(name).replace("; ", ";\n") for name in sides]
            values = [f"{point.value:.9f}", f"{math.degrees(point.value):.7f}"][: len(parameters)]
            table.add_row(
                str(number), point.label, *values, branch.stability_change(point), Text("\nthen ".join(names))
            )
    return table


def _make_table(title: str) -> Table:
    """Return an empty table that fits in a narrow terminal, where columns of text are folded and have no margins."""
    padding = (0, 1 if _is_wide() else 0)
    return Table(box=box.SIMPLE, pad_edge=False, padding=padding, title=title, title_justify="left")


def _name_parameter(diagram: BranchDiagram) -> list[str]:
    """Return the parameter with its unit and, for an angle, with the unit of figures if the terminal is wide enough."""
    unit = "" if diagram.unit in ("", "1") else f" [{diagram.unit}]"
    degrees = [f"{diagram.parameter} [deg]"] if diagram.unit == "rad" and _is_wide() else []
    return [f"{diagram.parameter}{unit}", *degrees]


def _is_wide() -> bool:
    """Return whether the output is as wide as most terminals."""
    return out.console.width >= USUAL_WIDTH


def _name_begin(diagram: BranchDiagram, branch: GaitBranch) -> str:
    """Return where a branch begins, in the words for its end; a branch of doubled period names the one it leaves."""
    if branch.parent is not None:
        return f"{SpecialKind.PERIOD_DOUBLING.label} of branch {branch.parent}"
    at_range_end = branch.begin == "start" and branch.values[0] in diagram.ends
    return _name_end("range_end" if at_range_end else branch.begin, branch.special[:1])


def _name_end(reason: str, nearest: Sequence[SpecialPoint]) -> str:
    """Return the reason for which a branch begins or ends: the label of the special point there, if it is one."""
    return next((point.label for point in nearest if point.kind.key == reason), reason.replace("_", " "))


def _curve_table(diagram: BranchDiagram) -> Table:
    """Return the table of the curves of special points."""
    first, second = diagram.curves[0].parameters
    table = _make_table("curves of special points, SI units")
    for column in ("kind", "points", first, second, "begins", "ends"):
        table.add_column(column, no_wrap=column == "points", overflow="fold")
    for curve in diagram.curves:
        low, high = curve.values.min(axis=0), curve.values.max(axis=0)
        spans = [f"{one:.6g} to {other:.6g}" for one, other in zip(low, high, strict=True)]
        ends = [Text(end.replace("_", " ")) for end in (curve.begin, curve.end)]
        table.add_row(curve.kind.label, str(len(curve.values)), *spans, *ends)
    return table


def _describe_resumption(path: Path | None) -> str:
    """Return how an interrupted trace is resumed from its checkpoint, or how it would have one."""
    if path is None or path.suffix.lower() != TABLE:
        return f"With -o FILE{TABLE}, a trace is stored in a checkpoint, from which it can be resumed."
    return f"{describe_stored_results('trace', path)} Run the same command again to resume.".lstrip()


def _write(diagram: BranchDiagram, path: Path, problem_of: "Callable[[], AnyWalkProblem]") -> None:
    """Write a diagram as a dataset, a page or a figure."""
    from gaitopt.continuation.diagram_file import save_diagram

    if path.suffix.lower() == TABLE:
        save_diagram(diagram, path)
        return
    if path.suffix.lower() == PAGE:
        from gaitopt.report.branch_page import write_branch_page

        write_branch_page(diagram, problem_of(), path)
        return
    from gaitopt.plot.branch_figure import plot_branches
    from gaitopt.plot.curve_figure import plot_curves
    from gaitopt.plot.saving import save_figure

    save_figure(plot_curves(diagram) if diagram.curves else plot_branches(diagram), path)
