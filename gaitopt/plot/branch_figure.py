"""The figure of a bifurcation diagram: a coordinate and the multipliers of gaits over a parameter."""

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import (
    BranchDiagram,
    GaitBranch,
    split_branch,
)
from gaitopt.continuation.gait_names import name_gaits
from gaitopt.errors import InputError, suggest
from gaitopt.motion.motion import Array
from gaitopt.motion.quantity_labels import label_quantity, show_unit
from gaitopt.plot.diagram_title import describe_model
from gaitopt.plot.legends import add_page_legend, extend_page
from gaitopt.plot.panels import widen_constant
from gaitopt.plot.radius_curves import interpolate_radii
from gaitopt.plot.special_marks import (
    ABOVE_MARKERS,
    LEAST_MARKER,
    MARKER,
    SpecialMark,
    choose_marker_size,
    draw_special_marks,
    explain_marker_sizes,
)
from gaitopt.plot.style import FigureStyle, angle_symbol, line_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitopt.continuation.optimal.optimal_branch import OptimalDiagram

MARKERS: dict[str, Any] = {
    "fold": "o",
    "period doubling": "D",
    "Neimark-Sacker": "s",
    "branch point": "P",
    "drift reversal": "X",
    "slip onset": "^",
    "impact cone": "v",
    "loss of stick": "<",
    "event coincidence": ">",
    "joint stop": "h",
    "scuffing": "*",
    "sequence change": "d",
    "lift off": "x",
    "limit of rolling over": "+",
    "fall": "|",
    "no touchdown": (6, 2, 0),
    "double support": "1",
    "Painleve paradox": "2",
    "unbounded multiplier": "3",
    "end": "4",
    "interrupted": "$?$",
}
"""Marker of each kind of special point, by its label; those at which branches end consist of lines.  The last one marks
ends at which a trace was interrupted."""

INTERRUPTED = "interrupted"
"""Reason of the end of a branch whose trace was interrupted, and label of its marker."""

STABLE: dict[str, Any] = {"linestyle": "-", "linewidth": 1.6}
UNSTABLE: dict[str, Any] = {"linestyle": (0, (3, 1.5)), "linewidth": 1.0}
STABLE_PIECE, UNSTABLE_PIECE = "_stable", "_unstable"
"""Labels of the lines of stable and unstable gaits, which have no entries in the legend."""

RADIUS_LABELS = ("spectral radius", "spectral radius\nof the period")
"""Labels of the axis of spectral radii, if all gaits have one step and otherwise."""

COINCIDENT = 2e-3
"""Distance, over the size of the axes, below which lines are drawn on each other."""

LARGEST_RADIUS = 4.0
"""Largest spectral radius that is shown, unless all are larger."""


Colors = dict[tuple[str, int], Any]
"""Colours of the gaits of different steps and of a period."""


@check_arguments
def plot_branches(
    diagram: BranchDiagram, *, coordinate: str | None = None, style: FigureStyle | None = None
) -> "Figure":
    r"""Draw the branches of a diagram: stable gaits as solid, unstable gaits as dashed lines.

    The upper panel shows a coordinate of the gaits after touchdown, at the start of each step of their period, the
    lower one the spectral radius over this period.  A colour means one contact sequence and period in both panels, a
    marker one kind of special point; the markers of gaits of longer periods are smaller.  Between the computed gaits,
    the spectral radius is that of the interpolated characteristic polynomial of the multipliers.

    Parameters
    ----------
    diagram : BranchDiagram
    coordinate : str, optional
        By default the first one.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the diagram is empty or has no such coordinate.

    Examples
    --------
    >>> from gaitopt import load_diagram, plot_branches
    >>> figure = plot_branches(load_diagram("docs/examples/compass_slope.nc"))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['$\\theta_{1}$ after touchdown [deg]', 'spectral radius\nof the period']
    """
    if not diagram.branches:
        raise InputError("The diagram has no branches to draw.")
    units = {name: unit for branch in diagram.branches for name, unit in zip(branch.names, branch.units, strict=True)}
    coordinate = coordinate or next(iter(units))
    if coordinate not in units:
        raise InputError(f"The gaits have no coordinate {coordinate!r}. {suggest(coordinate, units)}")
    style, factor = style or FigureStyle(), math.degrees(1) if units[coordinate] == "rad" else 1.0
    angular = diagram.unit == "rad"
    names = name_gaits(diagram)
    colors = {gaits: line_style(number)["color"] for number, gaits in enumerate(names)}
    several_steps, cut = any(branch.steps > 1 for branch in diagram.branches), _find_cut(diagram)
    drawn: list[tuple[GaitBranch, Array, Array]] = []
    with style.figure(5.2) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
        for branch in diagram.branches:
            values = np.degrees(branch.values) if angular else branch.values
            if coordinate not in branch.names:
                continue
            heights = factor * branch.orbits[:, :, branch.names.index(coordinate)]
            _draw_branch(upper, branch, values, heights, colors)
            _draw_radii(lower, branch, colors, cut, angular=angular)
            drawn.append((branch, values, heights))
        widen_constant(upper)
        marks: list[SpecialMark] = []
        for number, (branch, values, heights) in enumerate(drawn):  # sizes depend on the extent of all branches
            size = choose_marker_size(upper, branch.steps, values, heights)
            place = branch.names.index(coordinate), factor
            marks += _list_marks(diagram, branch, number, place, size, np.column_stack([values, heights[:, 0]]))
            if size <= LEAST_MARKER:  # the markers would hide a branch that is hardly longer than they are
                _draw_branch(upper, branch, values, heights, colors, zorder=ABOVE_MARKERS)
        draw_special_marks(upper, marks)
        lower.axhline(1, **(style.limit_line | {"linestyle": ":"}))  # dashes are unstable gaits
        lower.set(ylabel=RADIUS_LABELS[several_steps], xlabel=_parameter_label(diagram), ylim=(0, find_top(lower, cut)))
        _state_cut_radii(lower, diagram)
        figure.align_ylabels()
        upper.set_ylabel(f"{angle_symbol_of(coordinate)} after touchdown [{show_unit(units[coordinate])}]")
        handles, labels = _legend(upper, {names[gaits]: color for gaits, color in colors.items()})
        explain_marker_sizes(marks, handles, labels)
        lines = [[np.column_stack([values, row]) for row in heights.T] for _, values, heights in drawn]
        state_coincidence(upper, lines, handles, labels)
        add_titled_legend(figure, handles, labels, describe_diagram(diagram, style.width) * style.titled, style)
    return figure


def find_top(axes: "Axes", cut: float = LARGEST_RADIUS) -> float:
    """Return the upper end of an axis of spectral radii, which shows the stability limit."""
    return min(cut, 1.05 * max(1.2, float(axes.dataLim.y1)))


def state_coincidence(axes: "Axes", branches: list[list[Array]], handles: list[Any], labels: list[str]) -> None:
    """Add to the entries of a legend how many branches are drawn on the line of another one, if any are.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With all branches drawn.
    branches : list of lists of (K, 2) arrays
        Points of the lines of each branch.
    handles, labels : list
        Entries of the legend, which are extended.
    """
    from matplotlib.lines import Line2D

    size = np.asarray(axes.dataLim.size)
    scaled = [[line / np.where(size > 0, size, 1.0) for line in lines] for lines in branches]
    hidden = sum(
        any(
            _lies_on(lines, others) and (place < number or not _lies_on(others, lines))
            for place, others in enumerate(scaled)
            if place != number
        )
        for number, lines in enumerate(scaled)
    )
    if hidden:
        handles.append(Line2D([], [], linestyle="none"))
        labels.append(f"{hidden} of {len(branches)} branches coincide{'s' * (hidden == 1)} with another one")


def _lies_on(lines: list[Array], others: list[Array]) -> bool:
    """Return whether all points of a branch are on the lines of another one, in units of the size of the axes."""
    points = np.concatenate(lines)
    points = points[np.all(np.isfinite(points), axis=1)]
    distance = np.full(len(points), np.inf)
    for line in others:
        begins, steps = line[:-1], np.diff(line, axis=0)
        if len(begins):
            lengths = np.maximum(np.sum(steps**2, axis=1), np.finfo(float).tiny)
            offsets = points[:, np.newaxis] - begins
            shares = np.clip(np.sum(offsets * steps, axis=2) / lengths, 0.0, 1.0)
            gaps = np.linalg.norm(offsets - shares[..., np.newaxis] * steps, axis=2)
            distance = np.minimum(distance, np.min(np.where(np.isnan(gaps), np.inf, gaps), axis=1))
    return bool(points.size) and bool(np.all(distance < COINCIDENT))


def _find_cut(diagram: BranchDiagram) -> float:
    """Return the spectral radius above which none is shown; infinite if there would be nothing to see."""
    radii = np.concatenate([branch.radii for branch in diagram.branches])
    return LARGEST_RADIUS if np.any(radii < LARGEST_RADIUS) else math.inf


def _state_cut_radii(axes: "Axes", diagram: BranchDiagram) -> None:
    """State above an axis of spectral radii the largest radius, if its line leaves the axis."""
    radii = np.concatenate([branch.radii for branch in diagram.branches])
    largest = float(np.max(radii, initial=0.0, where=np.isfinite(radii)))
    if largest > axes.get_ylim()[1]:
        text = f"\N{UPWARDS ARROW} radii above {axes.get_ylim()[1]:g}, up to {largest:.3g}, are off the scale"
        axes.set_title(text, loc="right", fontsize="medium")


def describe_diagram(diagram: "BranchDiagram | OptimalDiagram", width: float, varied: Collection[str] = ()) -> str:
    """Return the title of a figure of a given width, without parameters that are varied.

    It states speed and step length if they are fixed.
    """
    facts = [
        f"{name.replace('_', ' ')} {value:.4g} {'m/s' if name == 'speed' else 'm'}"
        for name, value in getattr(diagram, "targets", {}).items()
    ]
    return describe_model(diagram.robot, diagram.parameters, width, varied={diagram.parameter, *varied}, facts=facts)


def add_titled_legend(
    figure: "Figure", handles: Sequence[Any], labels: Sequence[str], title: str, style: FigureStyle, *, columns: int = 4
) -> None:
    """Add a legend below the title of a figure, which is extended by their height."""
    legend = add_page_legend(
        figure, handles, labels, columns=columns, width=style.width, loc="outside upper center", title=title
    )
    legend.get_title().set_multialignment("center")
    extend_page(figure, legend, style.tallest)


def angle_symbol_of(coordinate: str) -> str:
    r"""Return the symbol of a coordinate of a section, with a dot if it is a rate.

    Examples
    --------
    >>> angle_symbol_of("foot_speed"), angle_symbol_of("th1_rate")
    ('foot speed', '$\\dot{\\theta}_{1}$')
    """
    name = coordinate.removesuffix("_rate")
    symbol = angle_symbol(name)
    if name != coordinate and symbol.startswith("$"):
        letter, mark, index = symbol[1:-1].partition("_")
        return rf"$\dot{{{letter}}}{mark}{index}$"  # the dot is over the letter, not over its index
    return symbol if symbol.startswith("$") else coordinate.replace("_", " ")


def _parameter_label(diagram: BranchDiagram) -> str:
    return label_quantity(diagram.parameter, diagram.unit)


def _draw_branch(
    axes: "Axes", branch: GaitBranch, values: Array, rows: Array, colors: Colors, zorder: float = 2
) -> None:
    """Draw a coordinate of a branch in pieces of equal sequence and stability, which have common points."""
    for piece, sequence, stable in split_branch(branch):
        axes.plot(values[piece], rows[piece], zorder=zorder, **_piece_style(branch, sequence, stable, colors))


def _draw_radii(axes: "Axes", branch: GaitBranch, colors: Colors, cut: float, *, angular: bool) -> None:
    """Draw the spectral radius of a branch, which is discontinuous between pieces of different sequences."""
    curves = interpolate_radii(branch)
    for piece, sequence, stable in split_branch(branch, joined=False):
        values, radii = (np.concatenate(parts) for parts in zip(*curves[piece.start : piece.stop - 1], strict=True))
        values = np.degrees(values) if angular else values
        axes.plot(values, np.minimum(radii, 2 * cut), **_piece_style(branch, sequence, stable, colors))


def _piece_style(branch: GaitBranch, sequence: str, stable: bool, colors: Colors) -> dict[str, Any]:
    """Return colour, dashes and label of the line of a piece of a branch."""
    look = STABLE | {"label": STABLE_PIECE} if stable else UNSTABLE | {"label": UNSTABLE_PIECE}
    return {"color": colors[sequence, branch.steps], **look}


def _list_marks(
    diagram: BranchDiagram, branch: GaitBranch, number: int, shown: tuple[int, float], size: float, line: Array
) -> list[SpecialMark]:
    """Return the markers of the special points of a branch, and of ends at which its trace was interrupted.

    The coordinate that is shown is given by its number and the factor to its unit.
    """
    place, factor = shown
    marks = []
    for point in branch.special:
        value = math.degrees(point.value) if diagram.unit == "rad" else point.value
        heights = factor * branch.orbit_of(point)[:, place]
        places = np.column_stack([np.full(heights.size, value), heights])
        marker = MARKERS.get(point.label, "x")
        marks.append(SpecialMark(branch=number, label=point.label, marker=marker, size=size, places=places, line=line))
    for gait, reason in ((0, branch.begin), (-1, branch.end)):
        if reason == INTERRUPTED:
            heights = factor * branch.orbits[gait, :, place]
            places = np.column_stack([np.full(heights.size, line[gait, 0]), heights])
            look: dict[str, Any] = {"label": INTERRUPTED, "marker": MARKERS[INTERRUPTED], "size": MARKER}
            marks.append(SpecialMark(branch=number, places=places, line=line, **look))
    return marks


def _legend(axes: "Axes", colors: dict[str, Any]) -> tuple[list[Any], list[str]]:
    """Return one entry for each kind of gaits and each kind of special point, and for unstable gaits if any."""
    from matplotlib.lines import Line2D

    entries: dict[str, Any] = {name: Line2D([], [], color=color) for name, color in colors.items()}
    if any(line.get_label() == UNSTABLE_PIECE for line in axes.lines):
        entries["unstable"] = Line2D([], [], color="0.3", **UNSTABLE)
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(label, handle)
    return list(entries.values()), list(entries)
