"""The figure of a gait, for a paper or a notebook."""

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.planar_gait import AnyGait, check_any_gait
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.plot import panels
from gaitopt.plot.gait_title import TITLE_LINES, describe_gait
from gaitopt.plot.impulse_marks import widen_legend_space
from gaitopt.plot.instant_labels import TALLEST
from gaitopt.plot.legends import add_inner_legend, add_page_legend, wrap_lines
from gaitopt.plot.literal_text import finish_texts
from gaitopt.plot.mode_bar import draw_mode_bar
from gaitopt.plot.slip_shading import name_enlargement, shade_slips, slip_handles
from gaitopt.plot.stick_figures import INSTANTS, draw_stick_figures
from gaitopt.plot.style import NARROW, WARNING, FigureStyle, root_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT, TITLE_HEIGHT, WARNING_HEIGHT = 8.6, 1.6, 0.65
"""In inches."""

NARROW_HEIGHT, FEW_INSTANTS, FEW_TICKS = 6.5, 5, 3
"""Of a column, which has no enlargements, fewer stick figures, and legends above their panels."""

CROWDED_STICKS = 1.25
"""Largest height of the stick figures above many panels of a column [inch]."""

TICK_STEPS = [1, 1.5, 2, 3, 4, 6, 8, 10]
"""Distances of ticks of which one always gives three ticks in a symmetric range of a column."""

KEY_LETTERS, TITLE_LETTERS, LINE_HEIGHT = 18, 12.5, 0.18
"""Characters in a line of the legend beside a panel, and per inch of the title; height of each further line of the
title [inch]."""

WARNING_LINES = 2
"""Number of lines that fit in the height of the warning."""

EXTRA_ROW, NARROW_ROW, LEAST_ROW, NARROW_KEY = 1.45, 0.79, 0.6, 0.25
"""Height of each panel beyond four; largest and least height of a panel of a column with a key above it that has the
last height [inch]."""

EDGES, KEY_SPACE, KEY_MARGIN = 0.85, 0.19, 0.05
"""Width of the labels beside the panels of a column, height of a key of one line above a panel, and least height
between a key in a panel and its lines [inch]."""

LABELS = {"normal forces": "$f_n$ /\nweight", "force ratio": "force\nratio", "foot speed": "foot\nspeed\n[m/s]"}
"""Labels of the panels of a column that has many of them; that of the force ratio is the same for fewer."""

COLUMN_SPACE = 3.4
"""Height of the panels of a column up to which their height is the largest [inch]."""

MOST_PANELS = 4

BAR_HEIGHT, LEAST_BAR, KEY_LINES = 0.42, 0.33, 5
"""Height of the bar of a contact over that of a panel, and least one in a column, in which the name of a mode fits;
lines of a key beside one of more than four panels, which is higher if its key has more."""

ENLARGED = ("force ratio", "foot speed")
"""Rows drawn again over short slip phases."""

SCALED = ("modes", "normal forces", "force ratio")
"""Rows whose range does not follow from the values alone."""

Rows = dict[str, Callable[["Axes", MotionView], None]]


def choose_rows(view: MotionView) -> Rows:
    """Return the panels of a motion by name, from top to bottom.

    Examples
    --------
    >>> from gaitopt import load
    >>> list(choose_rows(view_motion(load("docs/examples/compass_slip.h5").motion)))
    ['angles', 'torques', 'force ratio', 'foot speed']
    """
    units, several = {channel.unit for channel in view.actuators}, not view.is_single_support
    candidates = [
        ("modes", draw_mode_bar, several),
        ("angles", panels.draw_angles, bool(view.channels("rad"))),
        ("lengths", panels.draw_lengths, bool(view.channels("m"))),
        ("torques", panels.draw_torques, "N m" in units or not (units or several)),
        ("actuator forces", panels.draw_actuator_forces, "N" in units),
        ("normal forces", panels.draw_normal_forces, several and bool(view.loaded)),
        ("force ratio", panels.draw_force_ratio, bool(view.sliding)),
        ("foot speed", panels.draw_foot_speed, any(part.slipping for part in view.segments)),
    ]
    return {name: draw for name, draw, present in candidates if present}


@check_arguments
def plot_gait(gait: AnyGait, *, title: str | None = None, style: FigureStyle | None = None) -> "Figure":
    """Draw a gait: its step as stick figures; angles, torques, force ratio in the friction cone, and speed of slip.

    A robot with several contacts has further panels: the mode of each contact, lengths, forces of linear actuators and
    the normal force on each foot.

    Slip phases are shaded, and enlarged beside the time axis where they are too short to be read.  A gait that is not
    a solution is marked in the figure.

    Parameters
    ----------
    gait : Gait or PlanarGait
    title : str, optional
        First line of the title; by default the name of the problem.  Below is the contact sequence, without
        its last phases if it is longer than two lines, then the minimised objective and further numbers that have
        space; speed, step length and friction have another line if necessary.
    style : FigureStyle, optional
        Such as ``FigureStyle(width=3.5, titled=False)`` for a column of a journal, which has no space for enlargements.

    Returns
    -------
    matplotlib.figure.Figure
        Not tied to any window: save it with :func:`gaitopt.save_figure`, or show it as the last line of a
        notebook cell.

    Examples
    --------
    >>> from gaitopt import load, plot_gait
    >>> figure = plot_gait(load("docs/examples/compass_slip.h5"))
    >>> print(figure.get_suptitle().splitlines()[1])
    slip+ stick | slip+ (verified by replay)
    """
    check_any_gait(gait)
    view = None
    if is_drawable(gait.motion):
        view = view_motion(gait.motion, gait.problem.get("torque_limit"))
    style = style or FigureStyle()
    text = describe_gait(gait, title, int(TITLE_LETTERS * style.width))
    return _draw_figure(view, text, style, None if gait.status.ok else gait)


@check_arguments
def plot_motion(motion: AnyMotion, *, title: str = "", style: FigureStyle | None = None) -> "Figure":
    """Draw a simulated motion with the panels of :func:`plot_gait`.

    Parameters
    ----------
    motion : Motion or PlanarMotion
        Such as that of a simulated walk or of a periodic gait.
    title : str, optional
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the motion has no duration or is not finite.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> walk = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0.5, 0, 0, 0, 0], {}, duration=0.3)
    >>> [axes.get_label() for axes in plot_motion(walk.motion).axes][:2]
    ['stick figures', 'modes']
    """
    if not is_drawable(motion):
        raise InputError("The motion has no duration or is not finite; a figure needs finite positions.")
    return _draw_figure(view_motion(motion), title, style or FigureStyle(), None)


def _draw_figure(view: MotionView | None, title: str, style: FigureStyle, failed: AnyGait | None) -> "Figure":
    """Draw a motion below a title and, for a gait that is not a solution, a warning."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    warning, titled = _describe_failure(failed, style.width), style.titled and bool(title)
    warned = bool(warning)
    title = wrap_lines(title, int(TITLE_LETTERS * style.width))
    with rc_context(style.settings):
        crowded = style.width < NARROW and view is not None and len(choose_rows(view)) > MOST_PANELS
        more = max(title.count("\n") + 1 - TITLE_LINES, 0) * LINE_HEIGHT
        above = TITLE_HEIGHT + more if titled else TITLE_HEIGHT / 2 + KEY_SPACE * crowded
        box = WARNING_HEIGHT + max(warning.count("\n") + 1 - WARNING_LINES, 0) * LINE_HEIGHT if warned else 0.0
        height = min(_total_height(view, style) + box + above - TITLE_HEIGHT, style.tallest)
        layout = ConstrainedLayoutEngine(hspace=0.02, h_pad=0.01) if crowded else ConstrainedLayoutEngine(hspace=0.05)
        figure = Figure(figsize=(style.width, height), layout=layout)
        if titled:
            figure.suptitle(title, linespacing=1.4)
        grid = figure.add_gridspec(2 + warned, 1)
        if warned:
            _warn(figure.add_subplot(grid[0], label="warning"), warning)
        if view is not None:
            top = figure.add_subplot(grid[-2], label="stick figures")
            stick_height = _draw_top(top, view, style.width, CROWDED_STICKS if crowded else TALLEST)
            if style.width < NARROW:
                height = min(above + box + stick_height + _draw_column(figure, grid[-1], view), style.tallest)
                figure.set_figheight(height)
            else:
                _draw_panels(figure, grid[-1], view)
            heights = [box, stick_height, height - box - stick_height - above]
            grid.set_height_ratios(heights[-grid.nrows :])
        else:
            figure.text(0.5, 0.5, "The last iterate is not finite and is not drawn.", ha="center")
        finish_texts(figure)
        figure.draw_without_rendering()  # the layout of axes of equal aspect needs a second draw
    return figure


def _total_height(view: MotionView | None, style: FigureStyle) -> float:
    """Return the height of a figure without its warning [inch]; that of a column follows from its stick figures."""
    more = max(len(choose_rows(view)) - MOST_PANELS, 0) if view else 0
    return NARROW_HEIGHT if style.width < NARROW else HEIGHT + more * EXTRA_ROW


def _describe_failure(gait: AnyGait | None, width: float) -> str:
    """Return a text which states that a gait is not a solution, and why, in lines that fit in a width [inch]."""
    if gait is None:
        return ""
    return f"NOT A SOLUTION ({gait.status.key})\n{textwrap.fill(gait.status.hint, int(TITLE_LETTERS * width))}"


def _warn(axes: "Axes", text: str) -> None:
    """Draw a box with a warning."""
    box = {"boxstyle": "round", "facecolor": "#FFF0F0", "edgecolor": WARNING, "linewidth": 1.5}
    axes.text(0.5, 0.5, text, color=WARNING, ha="center", va="center", transform=axes.transAxes, bbox=box)
    axes.axis("off")


def _draw_top(axes: "Axes", motion: MotionView, width: float, tallest: float) -> float:
    """Draw the stick figures; return the height they need to fill the width, up to the largest one [inch]."""
    draw_stick_figures(axes, motion, FEW_INSTANTS if width < NARROW else INSTANTS, tallest=tallest)
    shape = np.ptp(axes.get_ylim()) / np.ptp(axes.get_xlim())
    return float(np.clip(width * shape, 1.0, tallest))


def _draw_column(figure: "Figure", place: Any, view: MotionView) -> float:
    """Draw the panels below one another, their keys above or in them; return the height that they need [inch]."""
    rows = choose_rows(view)
    crowded = len(rows) > MOST_PANELS
    shares = _row_heights(rows, view, least_bar=LEAST_BAR)
    row_height = float(np.clip(COLUMN_SPACE / sum(shares), LEAST_ROW, NARROW_ROW))
    heights = [row_height * share for share in shares]
    grid = place.subgridspec(len(rows), 1, height_ratios=heights)
    panels_drawn: list[Axes] = []
    for row, (name, draw) in enumerate(rows.items()):
        axes = figure.add_subplot(grid[row, 0], sharex=panels_drawn[0] if panels_drawn else None, label=name)
        panels_drawn.append(axes)
        draw(axes, view)
        _finish(name, axes, view)
        # Panels are less high than labels are long.
        label = LABELS.get(name) if name == "force ratio" or crowded else None
        axes.set_ylabel(label or _split_label(axes.get_ylabel()))
        if name == "force ratio":
            axes.locator_params(axis="y", nbins=FEW_TICKS, steps=TICK_STEPS)
        axes.tick_params(labelbottom=row == len(rows) - 1)
    axes.set_xlabel("time [s]")
    panels.limit_time(axes, view)
    size = figure.get_figwidth() - EDGES, row_height - NARROW_KEY - KEY_MARGIN
    keys = [_draw_column_key(axes, view, size if crowded else None) for axes in panels_drawn]
    needed = sum(heights) + sum(max(key - NARROW_KEY, 0.0) for key in keys)
    figure.align_ylabels(panels_drawn)
    if not crowded:
        return needed
    lines = 2 * bool(keys[0]) - keys[1:].count(0.0)  # the key of slip phases, whose length is below the stick figures
    return needed + KEY_SPACE * lines


def _draw_column_key(axes: "Axes", view: MotionView, size: tuple[float, float] | None) -> float:
    """Draw the key of a panel above it, or in one of a given width and height [inch] where it covers no line.

    Return the height of the key above the panel [inch].
    """
    figure = root_figure(axes)
    handles, labels = axes.get_legend_handles_labels()
    name = axes.get_label()
    if name == next(iter(choose_rows(view))):
        handles, labels = _add_slip_keys(handles, labels, view)
    if figure is None or not handles:
        return 0.0
    place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1, 0.94)}
    beside = widen_legend_space(axes)
    spacing = {"borderaxespad": 0.2, "columnspacing": 1.0}
    if name == "force ratio":  # a long key, whose diamond would reach the numbers of the axis
        spacing |= {"handlelength": 1.4, "handletextpad": 0.5}
    elif size and not beside and name != "modes" and add_inner_legend(axes, handles, labels, size=size):
        return 0.0
    width = figure.get_figwidth()
    key = add_page_legend(axes, handles, labels, columns=4, width=width, **place, **beside, **spacing)
    return float(key.get_window_extent().height / figure.dpi)


def _draw_panels(figure: "Figure", place: Any, view: MotionView) -> None:
    """Draw the panels on a common time axis, and beside them their keys and enlargements."""
    rows, phases = choose_rows(view), panels.short_slips(view)[:3]
    columns = max(len(phases), 1)
    widths = [4.4, *[max(1.7 / columns, 0.95) if phases else 1.1] * columns]
    heights = _row_heights(rows, view)
    grid = place.subgridspec(len(rows), 1 + columns, width_ratios=widths, height_ratios=heights)
    left: list[Axes] = []
    for row, (name, draw) in enumerate(rows.items()):
        axes = figure.add_subplot(grid[row, 0], sharex=left[0] if left else None, label=name)
        left.append(axes)
        draw(axes, view)
        _finish(name, axes, view)
        axes.tick_params(labelbottom=row == len(rows) - 1)
        if len(rows) > MOST_PANELS + (1 if name in ENLARGED else 3):  # the labels of enlarged rows are the longest ones
            axes.set_ylabel(_split_label(axes.get_ylabel()))
        if name not in ENLARGED:
            lines = _draw_key(figure.add_subplot(grid[row, 1:], label=f"{name} key"), axes, None if row else view)
            if len(rows) > MOST_PANELS:
                heights[row] = max(heights[row], lines / KEY_LINES)
            continue
        if name == "force ratio" and axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower center", ncols=2, borderaxespad=0.2, borderpad=0.1, frameon=True, edgecolor="none")
        for column, phase in enumerate(phases, start=1):
            beside = figure.add_subplot(grid[row, column], label=f"{name} enlarged")
            panels.enlarge(beside, view, phase, draw, beside=columns)
            beside.tick_params(labelbottom=name == ENLARGED[-1])
            if name == "foot speed":
                speeds = phase.slip_speeds[list(phase.slipping)]
                low, high = speeds.min(), speeds.max()
                margin = max(0.1 * (high - low), 1e-4)
                beside.set_ylim(low - margin, high + margin)
                beside.set_xlabel("time [ms]")
            else:
                name_enlargement(beside, phase)
    grid.set_height_ratios(heights)
    axes.set_xlabel("time [s]")
    panels.limit_time(axes, view)
    if view.is_single_support:
        panels.name_phases(left[0], view)
    figure.align_ylabels(left)


def _row_heights(rows: Rows, view: MotionView, least_bar: float = 0.0) -> list[float]:
    """Return the heights of the panels, relative to each other; that of the modes depends on the number of contacts."""
    count = len(view.closing)
    modes = min(BAR_HEIGHT * count, max(1.0, least_bar * count))
    return [modes if name == "modes" else 1.0 for name in rows]


def _split_label(label: str) -> str:
    """Return the label of an axis with its unit, or its last formula, on a separate line.

    Examples
    --------
    >>> _split_label("foot speed [m/s]").splitlines()
    ['foot speed', '[m/s]']
    """
    quantity, space, last = label.rpartition(" ")
    place = label.find(" [") if " [" in label else len(quantity) if space and last.startswith("$") else -1
    return label if place < 0 else f"{label[:place]}\n{label[place + 1 :]}"


def _finish(name: str, axes: "Axes", view: MotionView) -> None:
    """Shade slip phases and widen constant curves in all panels but the modes of the contacts."""
    if name != "modes":
        shade_slips(axes, view)
    if name not in SCALED:
        panels.widen_constant(axes)


def _draw_key(key: "Axes", axes: "Axes", motion: MotionView | None) -> int:
    """Draw the key of a panel in an empty axes beside it, with the shading of slip phases if a motion is given.

    Return the number of its lines.
    """
    key.axis("off")
    handles, labels = axes.get_legend_handles_labels()
    if motion:
        handles, labels = _add_slip_keys(handles, labels, motion)
    wrapped = [textwrap.fill(label, KEY_LETTERS) for label in labels]
    if handles:
        key.legend(handles, wrapped, loc="upper left", borderaxespad=0, handlelength=2.2)
    return sum(1 + label.count("\n") for label in wrapped)


def _add_slip_keys(handles: list[Any], labels: list[str], view: MotionView) -> tuple[list[Any], list[str]]:
    """Return handles and labels of a key with the shading of each kind of slip phase added."""
    patches = slip_handles(view)
    return [*handles, *patches], [*labels, *(str(patch.get_label()) for patch in patches)]
