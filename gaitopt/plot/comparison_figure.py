"""The figure of a comparison: overlaid trajectories of gaits, and the terms of their costs of transport."""

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import SLIDE, angle_entry
from gaitopt.motion.gait import Gait
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion import Array
from gaitopt.plot.legends import NO_BREAK, add_page_legend
from gaitopt.plot.panels import join_segments, sample_force_ratio, widen_constant
from gaitopt.plot.style import NARROW, FigureStyle, angle_symbol, line_style
from gaitopt.study.comparison import Comparison, energy_per_distance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TERMS = (
    ("impact_loss", "impact", "#4D4D4D", ""),
    ("friction_loss", "friction", "#E69F00", "///"),
    ("damping_loss", "dampers", "#6B9080", "xxx"),
    ("transition_loss", "transitions", "#56B4E9", "++"),
    ("twice_braking", "2 \N{MULTIPLICATION SIGN} braking", "#9C86BF", "..."),
    ("gravity", "\N{MINUS SIGN}gravity", "0.8", "\\\\\\"),
)
"""Terms of the cost of transport: name, label, colour, hatch.  The lines of gaits have none of these colours."""

LEAST_ROWS, MOST_ROWS, RATIO = 4, 6, 2.0
"""Rows that leave space for the bars' legend, rows that the bars extend over, width of the rows to that of the bars."""

MOST_LABELS, LABEL_LETTERS, LABEL_WIDTH, AXIS_WIDTH = 3, 14, 0.8, 0.6
"""Bars with labels below them; letters in a line of such a label; widths of one, and of an axis with numbers [inch]."""

LONGEST_COLUMN, TITLE_LETTERS = 7, 22
"""Rows above bars beyond which they are in two columns, with their labels above them; letters in a line of these."""

ROW_HEIGHT, NARROW_ROW_HEIGHT, BARS_HEIGHT, EDGES_HEIGHT = 1.0, 0.85, 2.2, 0.9
"""Heights of a row beside bars and above bars, of bars below the rows, and of legend and axis labels [inch]."""

Row = tuple[str, Callable[[Gait], list[Array]]]
"""Label of a row, and its values in each segment of a gait."""


@check_arguments
def plot_comparison(comparison: Comparison, *, style: FigureStyle | None = None) -> "Figure":
    """Overlay gaits as functions of the percentage of the step, and draw the terms of their costs of transport as bars.

    For gaits of several robots, the angles and actuators that all of them have are drawn.  A colour means one gait in
    all rows; bars of a column figure are drawn below the rows, otherwise beside them.  More than seven rows of a column
    figure are drawn in two columns.

    Parameters
    ----------
    comparison : Comparison
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If a gait is not finite, as the last iterate of a failed solve may be.

    Examples
    --------
    >>> from gaitopt import compare, load, plot_comparison
    >>> figure = plot_comparison(compare([load("docs/examples/compass_slip.h5")]))
    >>> [axes.get_ylabel() for axes in figure.axes][-1]
    'cost of transport'
    """
    style = style or FigureStyle()
    for label, gait in comparison.gaits.items():
        if not is_drawable(gait.motion):
            raise InputError(f"The gait {label!r} has no duration or is not finite: compare the others without it.")
    narrow = style.width < NARROW
    rows = _rows(comparison, unit_line=narrow)
    columns = 2 if narrow and len(rows) > LONGEST_COLUMN else 1
    above = NARROW_ROW_HEIGHT * -(-len(rows) // columns) if narrow else ROW_HEIGHT * max(len(rows), LEAST_ROWS)
    height = above + EDGES_HEIGHT + BARS_HEIGHT * narrow
    if height > style.tallest and not narrow:
        rows = _rows(comparison, unit_line=True)
    with style.figure(min(height, style.tallest)) as figure:
        grid, place = _divide_page(figure, len(rows), above, narrow=narrow)
        axes = _draw_rows(figure, grid[0].subgridspec(-(-len(rows) // columns), columns), rows, comparison)
        handles, labels = axes[0].get_legend_handles_labels()
        add_page_legend(figure, handles, labels, columns=4, width=style.width, loc="outside upper left")
        space = (style.width if narrow else style.width / (1 + RATIO)) - AXIS_WIDTH
        most_labels = min(MOST_LABELS, int(space / LABEL_WIDTH))
        _draw_costs(figure.add_subplot(place), comparison, columns=1 + 2 * narrow, most_labels=most_labels)
    return figure


def _divide_page(figure: "Figure", rows: int, above: float, *, narrow: bool) -> tuple[Any, Any]:
    """Return the grid of rows and bars of a figure, and the place of the bars in it."""
    if narrow:
        grid = figure.add_gridspec(2, 1, height_ratios=(above, BARS_HEIGHT))
        return grid, grid[1]
    grid = figure.add_gridspec(1, 2, width_ratios=(RATIO, 1))
    beside = [count for count in (min(rows, MOST_ROWS), rows - MOST_ROWS) if count > 0]
    return grid, grid[1].subgridspec(len(beside), 1, height_ratios=beside)[0]


def _rows(comparison: Comparison, *, unit_line: bool) -> list[Row]:
    """Return the rows; the unit of a torque is on a separate line where rows are less high than its label is long."""
    torque = "torque\n[N m]" if unit_line else "torque [N m]"
    motions = [gait.motion for gait in comparison.gaits.values()]
    angles = [name for name in motions[0].angles if all(name in motion.angles for motion in motions)]
    actuators = [name for name in motions[0].actuators if all(name in motion.actuators for motion in motions)]
    return [
        *((f"{_folded_name(name)}[deg]", _angle(name)) for name in angles),
        *((f"{angle_symbol(name)}\n{torque}", _torque(name)) for name in actuators),
        ("force ratio", lambda gait: [sample_force_ratio(segment) for segment in gait.motion.segments]),
        ("foot speed\n[m/s]", lambda gait: [segment.v[SLIDE] for segment in gait.motion.segments]),
    ]


def _folded_name(name: str) -> str:
    """Return an angle followed by a space if it has a symbol, and by a new line if it is written by its name."""
    symbol = angle_symbol(name)
    return f"{symbol} " if symbol.startswith("$") else f"{symbol}\n"


def _draw_rows(figure: "Figure", grid: Any, rows: list[Row], comparison: Comparison) -> "list[Axes]":
    """Draw the rows of all gaits over the step in a grid of one column or of two."""
    drawn: list[Axes] = []
    for number, (label, read) in enumerate(rows):
        column, row = divmod(number, grid.nrows)
        axes = figure.add_subplot(grid[row, column], sharex=drawn[0] if drawn else None)
        drawn.append(axes)
        for place, (name, gait) in enumerate(comparison.gaits.items()):
            axes.plot(*_over_step(gait, read(gait)), **line_style(place), label=name)
        widen_constant(axes)
        if grid.ncols == 1:
            axes.set_ylabel(label)
        else:
            title = textwrap.fill(label.replace("\n", " ").replace("N m", f"N{NO_BREAK}m"), TITLE_LETTERS)
            axes.set_title(title.replace(NO_BREAK, " "), loc="left", pad=2)
        axes.tick_params(labelbottom=row == grid.nrows - 1 or number == len(rows) - 1)
        if row == grid.nrows - 1:
            axes.set_xlabel("fraction of the step [%]")
    drawn[0].set_xlim(0, 100)
    if grid.ncols == 1:
        figure.align_ylabels(drawn)
    return drawn


def _over_step(gait: Gait, parts: list[Array]) -> tuple[Array, Array]:
    """Return percentages of the step and values, with gaps where one segment ends and the next begins."""
    time = join_segments([segment.time for segment in gait.motion.segments])
    return 100 * time / gait.period, join_segments(parts)


def _angle(name: str) -> Callable[[Gait], list[Array]]:
    return lambda gait: [np.rad2deg(s.q[angle_entry(gait.motion.angles.index(name))]) for s in gait.motion.segments]


def _torque(name: str) -> Callable[[Gait], list[Array]]:
    return lambda gait: [s.torque[gait.motion.actuators.index(name)] for s in gait.motion.segments]


def _draw_costs(axes: "Axes", comparison: Comparison, *, columns: int, most_labels: int) -> None:
    """Draw the cost of transport of each gait as a stack of its terms."""
    terms = [_cost_terms(gait) for gait in comparison.gaits.values()]
    places = np.arange(len(terms))
    above, below = np.zeros(len(terms)), np.zeros(len(terms))
    for name, label, color, hatch in TERMS:
        height = np.array([term.get(name, 0.0) for term in terms])
        if np.allclose(height, 0, atol=1e-9):
            continue
        base = np.where(height > 0, above, below)
        axes.bar(places, height, 0.6, bottom=base, color=color, hatch=hatch, edgecolor="white", label=label)
        above, below = above + np.maximum(height, 0), below + np.minimum(height, 0)
    labelled = len(terms) <= most_labels
    for place, term in zip(places, terms, strict=True):
        total = term["absolute_work"]
        key = "total" if place == 0 and not np.isclose(total, above[0]) else "_total"
        axes.plot([place - 0.35, place + 0.35], [total, total], color="0.1", linewidth=1.2, label=key)
        number: dict[str, Any] = {
            "textcoords": "offset points",
            "ha": "center",
            "va": "bottom",
            "rotation": 0 if labelled else 90,
        }
        axes.annotate(f"{total:#.4g}".rstrip("."), (place, above[place]), (0, 2), **number)
    if labelled:
        axes.set_xticks(places, [_wrap_label(label) for label in comparison.gaits])
    else:
        _draw_line_samples(axes, len(terms))
    axes.set_xlim(-0.6, len(terms) - 0.4)
    axes.set_ylabel("cost of transport")
    axes.set_ylim(top=(1.1 if labelled else 1.3) * max(above))
    axes.grid(visible=False, axis="x")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=columns, borderaxespad=0.2, columnspacing=1.0)


def _draw_line_samples(axes: "Axes", count: int) -> None:
    """Draw below each bar the line of its gait, as in the legend of the figure."""
    axes.set_xticks([])
    below: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    for number in range(count):
        axes.plot([number - 0.32, number + 0.32], [-0.04, -0.04], label="_sample", **line_style(number), **below)


def _cost_terms(gait: Gait) -> dict[str, float]:
    """Return the absolute work of a gait and its terms per weight and distance, which compares robots of any size."""
    weight = gait.motion.total_mass * gait.motion.parameters["gravity"]
    return {name: value / weight for name, value in energy_per_distance(gait).items()}


def _wrap_label(label: str) -> str:
    """Return a label on several lines, a contact sequence at its impact."""
    lines = label.replace(" | ", "\n| ").replace(", ", ",\n").replace(" (", "\n(").splitlines()
    return "\n".join(textwrap.fill(line, LABEL_LETTERS) for line in lines)
