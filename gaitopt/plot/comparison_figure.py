"""The figure of a comparison: overlaid trajectories of gaits, and the terms of their costs of transport."""

import re
import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.force_ratio import find_force_ratio
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import Channel, MotionView, PhaseView
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot.legends import NO_BREAK, add_page_legend, wrap_text
from gaitopt.plot.panels import join_segments, widen_constant
from gaitopt.plot.style import NARROW, FigureStyle, angle_symbol, line_style
from gaitopt.study.comparison import Comparison
from gaitopt.study.comparison_record import list_energy_terms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TERMS = (
    ("impact_loss", "impact", "#4D4D4D", ""),
    ("friction_loss", "friction", "#E69F00", "///"),
    ("damping_loss", "dampers", "#6B9080", "xxx"),
    ("transition_loss", "transitions", "#56B4E9", "++"),
    ("switched_springs", "\N{MINUS SIGN}switched springs", "#C9B458", "oo"),
    ("twice_braking", "2 \N{MULTIPLICATION SIGN} braking", "#9C86BF", "..."),
    ("gravity", "\N{MINUS SIGN}gravity", "0.8", "\\\\\\"),
)
"""Terms of the cost of transport: name, label, colour, hatch.  The lines of gaits have none of these colours."""

THIN = 0.04
"""Height of a part of a bar without hatch, over that of the highest bar."""

LEAST_ROWS, MOST_ROWS, RATIO = 4, 6, 2.0
"""Rows that leave space for the bars' legend, rows that the bars extend over, width of the rows to that of the bars."""

MOST_LABELS, LABEL_LINES, LABEL_WIDTH, NUMBER_WIDTH, AXIS_WIDTH, AXIS_SPACE = 3, 6, 0.8, 0.55, 0.6, 0.5
"""Bars with labels below them, and lines of such a label; widths of one, of the number above a bar, of an axis with
label and numbers, and of one with numbers [inch]."""

LETTER_SHARE = 0.58
"""Mean width of a letter over the size of letters."""

NUMBER_SHARES = (0.1, 0.28)
"""Shares of the height of the bars' axis for horizontal and for vertical numbers above them."""

LONGEST_COLUMN = 7
"""Rows above bars beyond which they are in two columns, with their labels above them."""

ROW_HEIGHT, NARROW_ROW_HEIGHT, BARS_HEIGHT, EDGES_HEIGHT, KEY_HEIGHT = 1.0, 0.85, 2.2, 0.9, 0.35
"""Heights of a row beside bars and above bars, of bars below the rows, of legend and axis labels, and of a legend that
these include [inch]."""

DRAWN_UNITS = {"rad": "deg", "m": "m"}
"""Unit in which coordinates of a unit are drawn."""

Row = tuple[str, Callable[[MotionView], list[Array]]]
"""Label of a row, and its values in each segment of a motion."""


@check_arguments
def plot_comparison(comparison: Comparison, *, style: FigureStyle | None = None) -> "Figure":
    """Overlay gaits as functions of the percentage of the step, and draw the terms of their costs of transport as bars.

    For gaits of several robots, the coordinates and actuators that all of them have are drawn. Of several feet on
    the ground, the force ratio and the speed are those of the foot for which they are largest; the speed is drawn
    if a foot slips. If a robot does not travel, the bars are energies per period. A colour means one gait in all
    rows; bars of a column figure are drawn below the rows, otherwise beside them. More than seven rows of a column
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
        letter = LETTER_SHARE * (style.font_size - 0.5) / 72
        places = grid[0].subgridspec(-(-len(rows) // columns), columns)
        axes = _draw_rows(figure, places, rows, comparison, int((style.width / columns - AXIS_SPACE) / letter))
        handles, labels = axes[0].get_legend_handles_labels()
        legend = add_page_legend(figure, handles, labels, columns=4, width=style.width, loc="outside upper left")
        more = max(legend.get_window_extent().height / figure.dpi - KEY_HEIGHT, 0.0)
        figure.set_figheight(min(height + more, style.tallest))
        space = (style.width if narrow else style.width / (1 + RATIO)) - AXIS_WIDTH
        _draw_costs(figure.add_subplot(place), comparison, columns=1 + 2 * narrow, space=space, letter=letter)
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
    """Return the rows; labels have more lines where rows are less high than a label is long."""
    torque = "torque\n[N m]" if unit_line else "torque [N m]"
    views = [view_motion(gait.motion) for gait in comparison.gaits.values()]
    coordinates = _list_common([[each for unit in ("rad", "m") for _, each in view.channels(unit)] for view in views])
    force = torque.replace("torque", "force").replace("N m", "N")
    speed: Row = (
        "foot\nspeed\n[m/s]" if unit_line else "foot speed\n[m/s]",
        lambda view: [_find_largest(part, view, _sample_speed) for part in view.segments],
    )
    return [
        *(
            (f"{_folded_name(one.name)}[{'deg' if one.unit == 'rad' else 'm'}]", _coordinate(one))
            for one in coordinates
        ),
        *(
            (f"{angle_symbol(one.name)}\n{torque if one.unit == 'N m' else force}", _torque(one))
            for one in _list_common([view.actuators for view in views])
        ),
        (
            "force\nratio" if unit_line else "force ratio",
            lambda view: [_find_largest(part, view, _sample_ratio) for part in view.segments],
        ),
        *([speed] if any(part.slipping for view in views for part in view.segments) else []),
    ]


def _list_common(channels: Sequence[Sequence[Channel]]) -> list[Channel]:
    """Return the channels that all robots have."""
    return [each for each in channels[0] if all(each in others for others in channels)]


def _folded_name(name: str) -> str:
    """Return an angle followed by a space if it has a symbol, and by a new line if it is written by its name."""
    symbol = angle_symbol(name)
    return f"{symbol} " if symbol.startswith("$") else f"{symbol}\n"


def _draw_rows(figure: "Figure", grid: Any, rows: list[Row], comparison: Comparison, letters: int) -> "list[Axes]":
    """Draw the rows of all gaits over the step in a grid of one column, or of two, both of which end at the bottom.

    The labels of two columns are above the rows, in lines of a number of letters.
    """
    drawn: list[Axes] = []
    for number, (label, read) in enumerate(rows):
        column, row = divmod(number, grid.nrows)
        row += column * (2 * grid.nrows - len(rows))
        axes = figure.add_subplot(grid[row, column], sharex=drawn[0] if drawn else None)
        drawn.append(axes)
        for place, (name, gait) in enumerate(comparison.gaits.items()):
            view = view_motion(gait.motion)
            axes.plot(*_over_step(view, read(view)), **line_style(place), label=name)
        widen_constant(axes)
        if grid.ncols == 1:
            axes.set_ylabel(label)
        else:
            title = textwrap.fill(label.replace("\n", " ").replace("N m", f"N{NO_BREAK}m"), letters)
            axes.set_title(title.replace(NO_BREAK, " "), loc="left", pad=2)
        axes.tick_params(labelbottom=row == grid.nrows - 1)
        if row == grid.nrows - 1:
            axes.set_xlabel("fraction of the step [%]" if grid.ncols == 1 else "step [%]")
    drawn[0].set_xlim(0, 100)
    if grid.ncols == 1:
        figure.align_ylabels(drawn)
    return drawn


def _over_step(view: MotionView, parts: list[Array]) -> tuple[Array, Array]:
    """Return percentages of the step and values, with gaps where one segment ends and the next begins."""
    time = join_segments([segment.time - view.segments[0].time[0] for segment in view.segments])
    return 100 * time / view.period, join_segments(parts)


def _coordinate(channel: Channel) -> Callable[[MotionView], list[Array]]:
    scale = np.rad2deg(1.0) if channel.unit == "rad" else 1.0
    return lambda view: [scale * part.q[view.coordinates.index(channel)] for part in view.segments]


def _torque(channel: Channel) -> Callable[[MotionView], list[Array]]:
    return lambda view: [part.torque[view.actuators.index(channel)] for part in view.segments]


def _find_largest(part: PhaseView, view: MotionView, sample: Callable[[PhaseView, list[int]], Array]) -> Array:
    """Return a quantity of the leg on the ground for which its magnitude is largest; nan in flight."""
    legs: dict[int, list[int]] = {}
    for foot in view.sliding:
        if part.modes[foot] is not Mode.FREE:
            legs.setdefault(view.leg_of(foot), []).append(foot)
    values = np.array([sample(part, feet) for feet in legs.values()] or [np.full(part.time.size, np.nan)])
    largest = np.argmax(np.nan_to_num(np.abs(values), nan=-1.0), axis=0)
    return values[largest, np.arange(part.time.size)]


def _sample_ratio(part: PhaseView, feet: list[int]) -> Array:
    """Return the ratio of tangential to normal force of a leg, whose contacts such as heel and toe are added."""
    force = part.forces[feet].sum(axis=0)
    return find_force_ratio(force, float(np.max(force[1])))


def _sample_speed(part: PhaseView, feet: list[int]) -> Array:
    return part.slip_speeds[feet[0]]


def _draw_costs(axes: "Axes", comparison: Comparison, *, columns: int, space: float, letter: float) -> None:
    """Draw the cost of transport of each gait as a stack of its terms; the energy if a robot does not travel.

    The axis and a letter of its labels have the given widths [inch].
    """
    per_distance = all(gait.step_length for gait in comparison.gaits.values())
    terms = [_cost_terms(gait, per_distance=per_distance) for gait in comparison.gaits.values()]
    places = np.arange(len(terms))
    above, below = _draw_bars(axes, terms)
    width = space / (len(terms) + 0.2)
    letters = max(int(width / letter) - 1, 1)
    labels = [_wrap_label(label, letters) for label in comparison.gaits]
    fitting = all(label.count("\n") < LABEL_LINES and _longest_line(label) <= letters for label in labels)
    labelled = fitting and len(terms) <= min(MOST_LABELS, int(space / LABEL_WIDTH))
    vertical = width < NUMBER_WIDTH
    for place, term in zip(places, terms, strict=True):
        total = term["absolute_work"]
        key = "total" if place == 0 and not np.isclose(total, above[0]) else "_total"
        axes.plot([place - 0.35, place + 0.35], [total, total], color="0.1", linewidth=1.2, label=key)
        number: dict[str, Any] = {
            "textcoords": "offset points",
            "ha": "center",
            "va": "bottom",
            "rotation": 90 if vertical else 0,
        }
        axes.annotate(f"{total:#.4g}".rstrip("."), (place, above[place]), (0, 2), **number)
    if labelled:
        axes.set_xticks(places, labels)
    else:
        _draw_line_samples(axes, len(terms))
    axes.set_xlim(-0.6, len(terms) - 0.4)
    axes.set_ylabel("cost of transport" if per_distance else "energy per period [J]")
    share = NUMBER_SHARES[vertical]
    axes.set_ylim(top=max(above) + share / (1 - share) * (max(above) - min(below)))
    axes.grid(visible=False, axis="x")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=columns, borderaxespad=0.2, columnspacing=1.0)


def _draw_bars(axes: "Axes", terms: list[dict[str, float]]) -> tuple[Array, Array]:
    """Draw the terms of each gait as a bar; white edges, and hatches of thin parts, would hide their colours.

    Return the ends of the bars above and below zero.
    """
    above, below = np.zeros(len(terms)), np.zeros(len(terms))
    thin = THIN * max(sum(max(value, 0.0) for name, *_ in TERMS if (value := term.get(name))) for term in terms)
    for name, label, color, hatch in TERMS:
        height = np.array([term.get(name, 0.0) for term in terms])
        if np.allclose(height, 0, atol=1e-9):
            continue
        look: dict[str, Any] = {"color": color, "edgecolor": "white", "linewidth": 0}
        hatches = [hatch if abs(each) > thin else "" for each in height]
        axes.bar(range(len(terms)), height, 0.6, bottom=np.where(height > 0, above, below), hatch=hatches, **look)
        axes.bar(0, 0, hatch=hatch, label=label, **look)  # of the legend, which has hatches also if all parts are thin
        above, below = above + np.maximum(height, 0), below + np.minimum(height, 0)
    return above, below


def _draw_line_samples(axes: "Axes", count: int) -> None:
    """Draw below each bar the line of its gait, as in the legend of the figure."""
    axes.set_xticks([])
    below: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    for number in range(count):
        axes.plot([number - 0.32, number + 0.32], [-0.04, -0.04], label="_sample", **line_style(number), **below)


def _cost_terms(gait: AnyGait, *, per_distance: bool) -> dict[str, float]:
    """Return the absolute work of a gait and its terms, if required per weight and distance [1], otherwise in J."""
    unit = view_motion(gait.motion).weight * gait.step_length if per_distance else 1.0
    return {name: value / unit for name, value in list_energy_terms(gait).items()}


def _wrap_label(label: str, letters: int) -> str:
    r"""Return a label in lines of a number of letters, a contact sequence at its impact; some lines may be longer.

    The names of files, which are in brackets, are divided after underscores.

    Examples
    --------
    >>> _wrap_label("slip+ stick | slip+", 14), _wrap_label("foot stick > flight | (high_hop)", 12)
    ('slip+ stick\n| slip+', 'foot stick >\nflight |\n(high_hop)')
    >>> _wrap_label("stick | stick (high_hop)", 8)
    'stick\n| stick\n(high_\nhop)'
    """
    lines = label.replace(" (", "\n(").replace(" | ", "\n| ").replace(", ", ",\n").splitlines()
    return "\n".join(
        wrap_text(line, letters, divide=False) if " " in line else _divide(line, letters) for line in lines
    )


def _divide(word: str, letters: int) -> str:
    """Return a word in lines of a number of letters that end with underscores."""
    lines = [""]
    for part in re.findall("[^_]*_|[^_]+", word):
        if lines[-1] and len(lines[-1] + part) > letters:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def _longest_line(text: str) -> int:
    """Return the number of letters of the longest line of a text."""
    return max(map(len, text.splitlines()), default=0)
