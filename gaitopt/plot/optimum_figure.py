"""The figure of branches of optimal gaits: cost and multipliers over a parameter."""

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.optimal.optimal_branch import OptimalBranch, OptimalDiagram
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.quantity_labels import label_quantity
from gaitopt.ocp.statement.objective_names import OBJECTIVES
from gaitopt.plot.branch_figure import (
    INTERRUPTED,
    LARGEST_RADIUS,
    MARKERS,
    add_titled_legend,
    describe_diagram,
    find_top,
    state_coincidence,
)
from gaitopt.plot.special_marks import SpecialMark, draw_special_marks
from gaitopt.plot.style import FigureStyle, line_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SPECIAL_MARKERS = {"activation": "^", "deactivation": "v", "turning_point": "o", "cost_extremum": "D"}
"""Marker of each kind of special point."""

MARKER = 4.0
"""Size of a marker [pt]."""

DASHES, OTHER_PIECE = (0, (3, 1.5)), "_not_minimum"
"""Dashes and label of lines of points that are not minima, which have one entry in the legend."""

BORDER = "border of lowest cost"


@check_arguments
def plot_optima(diagram: OptimalDiagram, *, style: FigureStyle | None = None) -> "Figure":
    """Draw the cost of optimal gaits over a parameter, and their spectral radius with the torques in open loop.

    A colour means one contact sequence.  Minima are solid lines, other points of the branches dashed ones; markers are
    special points, and vertical lines the borders at which another contact sequence has the lowest cost.

    Parameters
    ----------
    diagram : OptimalDiagram
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the diagram is empty.

    Examples
    --------
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped
    >>> from gaitopt.continuation import trace_optimum
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.25, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared",
    ...                       transcription=Collocation(intervals=10))
    >>> figure = plot_optima(trace_optimum(problem, {"friction": (0.25, 0.2)}))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['torque squared [N² m² s]', 'spectral radius']
    """
    if not any(branch.values.size for branch in diagram.branches):
        raise InputError("The diagram has no branches to draw.")
    style, angular = style or FigureStyle(), diagram.unit == "rad"
    names = dict.fromkeys(branch.sequence for branch in diagram.branches)
    colors = {name: line_style(number)["color"] for number, name in enumerate(names)}
    with style.figure(5.2) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
        for branch in diagram.branches:
            _draw(upper, lower, branch, colors[branch.sequence], angular=angular)
        marks = (_list_marks(branch, number, angular=angular) for number, branch in enumerate(diagram.branches))
        draw_special_marks(upper, list(itertools.chain.from_iterable(marks)))
        for border in diagram.borders:
            value = math.degrees(border.value) if angular else border.value
            for axes in (upper, lower):
                axes.axvline(value, label=BORDER, **style.limit_line)
        lower.axhline(1, **(style.limit_line | {"linestyle": ":"}))  # dashes are points that are not minima
        label = label_quantity(diagram.parameter, diagram.unit)
        lower.set(ylabel="spectral radius", xlabel=label, ylim=(0, find_top(lower)))
        objective = OBJECTIVES.get(diagram.objective)
        upper.set_ylabel(label_quantity(diagram.objective, objective.unit if objective else ""))
        figure.align_ylabels()
        handles, labels = _legend_entries(upper, colors)
        factor = math.degrees(1) if angular else 1.0
        lines = [[np.column_stack([factor * branch.values, branch.costs])] for branch in diagram.branches]
        state_coincidence(upper, lines, handles, labels)
        add_titled_legend(figure, handles, labels, describe_diagram(diagram, style.width) * style.titled, style)
    return figure


def _draw(upper: "Axes", lower: "Axes", branch: OptimalBranch, color: Any, *, angular: bool) -> None:
    """Draw one branch in both panels."""
    values = np.degrees(branch.values) if angular else branch.values
    for curve, costs, minimum in _pieces(branch):
        label, dashes = ("_branch", "-") if minimum else (OTHER_PIECE, DASHES)
        curve = np.degrees(curve) if angular else curve
        upper.plot(curve, costs, color=color, linestyle=dashes, label=label)
    known = np.isfinite(branch.multipliers).any(axis=1)
    radii = np.nanmax(np.abs(branch.multipliers[known]), axis=1) if known.any() else np.empty(0)
    lower.plot(values[known], np.minimum(radii, 2 * LARGEST_RADIUS), color=color, label="_branch")


def _list_marks(branch: OptimalBranch, number: int, *, angular: bool) -> list[SpecialMark]:
    """Return the markers of the special points of a branch, and of an end at which its trace was interrupted."""
    factor = math.degrees(1) if angular else 1.0
    line = np.column_stack([factor * branch.values, branch.costs])
    look: dict[str, Any] = {"branch": number, "size": MARKER, "line": line}
    marks = [
        SpecialMark(
            label=point.label,
            marker=SPECIAL_MARKERS.get(point.kind, "x"),
            places=np.array([[factor * point.value, point.cost]]),
            **look,
        )
        for point in branch.special
    ]
    if branch.end == INTERRUPTED and branch.values.size:
        marks.append(SpecialMark(label=INTERRUPTED, marker=MARKERS[INTERRUPTED], places=line[-1:], **look))
    return marks


def _pieces(branch: OptimalBranch) -> list[tuple[Array, Array, bool]]:
    """Return values and costs of the pieces of a branch that consist of minima or not, special points included.

    A piece ends at the first point of the next one.
    """
    places = [point.place for point in branch.special]
    values = np.insert(branch.values, places, [point.value for point in branch.special])
    costs = np.insert(branch.costs, places, [point.cost for point in branch.special])
    last = branch.values.size - 1
    minimum = np.insert(branch.minimum, places, [branch.minimum[min(place, last)] for place in places])
    changes = np.flatnonzero(np.diff(minimum)) + 1
    begins, ends = [0, *changes.tolist()], [*(changes + 1).tolist(), values.size]
    return [(values[i:j], costs[i:j], bool(minimum[i])) for i, j in zip(begins, ends, strict=True)]


def _legend_entries(axes: "Axes", colors: dict[str, Any]) -> tuple[list[Any], list[str]]:
    """Return one entry for each contact sequence and each kind of special point."""
    from matplotlib.lines import Line2D

    entries: dict[str, Any] = {name: Line2D([], [], color=color) for name, color in colors.items()}
    if any(line.get_label() == OTHER_PIECE for line in axes.lines):
        entries["not a minimum"] = Line2D([], [], color="0.3", linestyle=DASHES)
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(label, handle)
    return list(entries.values()), list(entries)
