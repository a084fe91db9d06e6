"""The figure of a gait, for a paper or a notebook."""

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.motion.gait import Gait, check_gait
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion import Motion
from gaitopt.plot import panels
from gaitopt.plot.legends import add_page_legend
from gaitopt.plot.stick_figures import INSTANTS, draw_stick_figures
from gaitopt.plot.style import MODE_FILL, MODE_HATCH, NARROW, WARNING, FigureStyle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT, TITLE_HEIGHT, WARNING_HEIGHT = 8.6, 1.6, 0.65
"""In inches."""

NARROW_HEIGHT, FEW_INSTANTS = 8.4, 5
"""Of a column, which has no enlargements, fewer stick figures, and legends above their panels."""

KEY_LETTERS = 18
"""Letters in a line of a key beside its panel."""

ROWS: dict[str, Callable[["Axes", Gait], None]] = {
    "angles": panels.draw_angles,
    "torques": panels.draw_torques,
    "force ratio": panels.draw_force_ratio,
    "foot speed": panels.draw_foot_speed,
}
ENLARGED = ("force ratio", "foot speed")
"""Rows drawn again over short slip phases."""


def plot_gait(gait: Gait, *, title: str | None = None, style: FigureStyle | None = None) -> "Figure":
    """Draw a gait: its step as stick figures; angles, torques, force ratio in the friction cone, and foot speed.

    Slip phases are shaded, and enlarged beside the time axis where they are too short to be read.  A gait that is not
    a solution is marked in the figure.

    Parameters
    ----------
    gait : Gait
    title : str, optional
        First line of the title; by default the name of the problem.
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
    slip+ stick | slip+, verified by replay
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    check_gait(gait)
    style = style or FigureStyle()
    warned, narrow = not gait.status.ok, style.width < NARROW
    above = TITLE_HEIGHT if style.titled else TITLE_HEIGHT / 2
    height = (NARROW_HEIGHT if narrow else HEIGHT) + warned * WARNING_HEIGHT + above - TITLE_HEIGHT
    with rc_context(style.settings):
        figure = Figure(figsize=(style.width, height), layout=ConstrainedLayoutEngine(hspace=0.05))
        if style.titled:
            figure.suptitle(_describe(gait, title), linespacing=1.4)
        grid = figure.add_gridspec(2 + warned, 1)
        if warned:
            _warn(figure.add_subplot(grid[0], label="warning"), gait)
        if is_drawable(gait.motion):
            stick_height = _draw_top(figure.add_subplot(grid[-2], label="stick figures"), gait.motion, style.width)
            (_draw_column if narrow else _draw_panels)(figure, grid[-1], gait)
            heights = [WARNING_HEIGHT, stick_height, height - warned * WARNING_HEIGHT - stick_height - above]
            grid.set_height_ratios(heights[-grid.nrows :])
        else:
            figure.text(0.5, 0.5, "The last iterate is not finite and is not drawn.", ha="center")
        figure.draw_without_rendering()  # the layout of axes of equal aspect needs a second draw
    return figure


def _describe(gait: Gait, title: str | None) -> str:
    """Return the title: name, contact sequence, and main numbers."""
    slope = np.rad2deg(gait.motion.parameters["slope"])
    facts = [
        f"cost of transport {_number(gait, 'cost_of_transport', '.4g')}",
        f"speed {_number(gait, 'speed', '.3g')} m/s",
        f"step length {_number(gait, 'step_length', '.4g')} m",
        rf"friction $\mu$ = {gait.motion.parameters['friction']:g}",
    ]
    where = f" on a slope of {slope:.3g}\N{DEGREE SIGN} downhill" if slope else ""
    verified = "" if not gait.status.ok else ", verified by replay" if gait.verification else ", not replayed"
    name = gait.problem.get("name", "gait")
    first = title or (gait.robot_name.replace("_", " ") if name == "gait" else name)
    return f"{first}\n{gait.sequence}{where}{verified}\n{', '.join(facts)}"


def _number(gait: Gait, name: str, form: str) -> str:
    """Return a number of a gait as text; it may be undefined for the last iterate of a failed solve."""
    try:
        return format(getattr(gait, name), form)
    except ZeroDivisionError:
        return "nan"


def _warn(axes: "Axes", gait: Gait) -> None:
    """Draw a box which states that the gait is not a solution, and why."""
    text = f"NOT A SOLUTION ({gait.status.key})\n{textwrap.fill(gait.status.hint, 100)}"
    box = {"boxstyle": "round", "facecolor": "#FFF0F0", "edgecolor": WARNING, "linewidth": 1.5}
    axes.text(0.5, 0.5, text, color=WARNING, ha="center", va="center", transform=axes.transAxes, bbox=box)
    axes.axis("off")


def _draw_top(axes: "Axes", motion: Motion, width: float) -> float:
    """Draw the stick figures; return the height they need to fill the width [inch]."""
    draw_stick_figures(axes, motion, FEW_INSTANTS if width < NARROW else INSTANTS)
    shape = np.ptp(axes.get_ylim()) / np.ptp(axes.get_xlim())
    return float(np.clip(width * shape, 1.0, 2.4))


def _draw_column(figure: "Figure", place: Any, gait: Gait) -> None:
    """Draw the panels below one another, their keys above them."""
    grid = place.subgridspec(len(ROWS), 1)
    panels_drawn: list[Axes] = []
    for row, (name, draw) in enumerate(ROWS.items()):
        axes = figure.add_subplot(grid[row, 0], sharex=panels_drawn[0] if panels_drawn else None, label=name)
        panels_drawn.append(axes)
        draw(axes, gait)
        panels.shade_slips(axes, gait.motion)
        axes.tick_params(labelbottom=row == len(ROWS) - 1)
        handles, labels = axes.get_legend_handles_labels()
        if handles:
            place_above: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1, 0.94)}
            spacing = {"borderaxespad": 0.2, "columnspacing": 1.0}
            add_page_legend(axes, handles, labels, columns=4, width=figure.get_figwidth(), **place_above, **spacing)
    axes.set_xlabel("time [s]")
    axes.set_xlim(gait.motion.segments[0].time[0], gait.motion.segments[-1].time[-1])
    figure.align_ylabels(panels_drawn)


def _draw_panels(figure: "Figure", place: Any, gait: Gait) -> None:
    """Draw the panels on a common time axis, and beside them their keys and enlargements."""
    motion = gait.motion
    phases = panels.short_slips(motion)[:3]
    columns = max(len(phases), 1)
    widths = [4.4, *[max(1.7 / columns, 0.95) if phases else 1.1] * columns]
    grid = place.subgridspec(len(ROWS), 1 + columns, width_ratios=widths)
    left: list[Axes] = []
    for row, (name, draw) in enumerate(ROWS.items()):
        axes = figure.add_subplot(grid[row, 0], sharex=left[0] if left else None, label=name)
        left.append(axes)
        draw(axes, gait)
        panels.shade_slips(axes, motion)
        axes.tick_params(labelbottom=row == len(ROWS) - 1)
        if name not in ENLARGED:
            _draw_key(figure.add_subplot(grid[row, 1:], label=f"{name} key"), axes, motion if row == 0 else None)
            continue
        if name == "force ratio":
            axes.legend(loc="lower center", ncols=2, borderaxespad=0.2, borderpad=0.1, frameon=True, edgecolor="none")
        for column, phase in enumerate(phases, start=1):
            beside = figure.add_subplot(grid[row, column], label=f"{name} enlarged")
            panels.enlarge(beside, gait, phase, draw)
            beside.tick_params(labelbottom=name == ENLARGED[-1])
            if name == "foot speed":
                low, high = phase.v[SLIDE].min(), phase.v[SLIDE].max()
                margin = max(0.1 * (high - low), 1e-4)
                beside.set_ylim(low - margin, high + margin)
                beside.set_xlabel("time [ms]")
            else:
                panels.name_enlargement(beside, phase)
    axes.set_xlabel("time [s]")
    axes.set_xlim(motion.segments[0].time[0], motion.segments[-1].time[-1])
    panels.name_phases(left[0], motion)
    figure.align_ylabels(left)


def _draw_key(key: "Axes", axes: "Axes", motion: Motion | None) -> None:
    """Draw the key of a panel in an empty axes beside it, with the shading of slip phases if a motion is given."""
    from matplotlib.patches import Patch

    key.axis("off")
    handles, labels = axes.get_legend_handles_labels()
    for mode in dict.fromkeys(part.mode for part in motion.segments if part.mode.slips) if motion else ():
        color = MODE_FILL[mode]
        handles.append(Patch(facecolor=(color, 0.3), edgecolor=color, hatch=MODE_HATCH[mode]))
        labels.append(f"{mode.label} phase")
    if handles:
        wrapped = [textwrap.fill(label, KEY_LETTERS) for label in labels]
        key.legend(handles, wrapped, loc="upper left", borderaxespad=0, handlelength=2.2)
