"""Impulses of actuators in the panels of torques and forces: stems at their impact, on an axis on the right."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.motion.actuator_impulses import Moment
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView
from gaitopt.plot.style import NARROW, line_style, root_figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

CARETS: dict[Moment, int] = {"before": 8, "after": 9}
"""Matplotlib's triangles to the left and to the right of a point."""

OFFSET = {"before": -1.2, "after": 1.2}
"""Distance of a stem from the instant of the impact, so that two impulses of one impact are visible [point]."""

AXIS_WIDTH, NUMBERS_WIDTH = 5.2, 2.6
"""Widths of the numbers and the label of the axis on the right, and of its numbers alone, over the size of letters."""

HEADROOM, LEAST_SHARE = 1.15, 0.3
"""Height of the axis over the largest impulse, and least share of either side of zero that has impulses."""


def draw_actuator_impulses(axes: "Axes", view: MotionView, rows: "Mapping[int, int]", unit: str) -> None:
    """Draw the impulses of actuators as stems at their impacts, in the colours of the actuators.

    Those just before an impact have a mark to the left of the stem, those just after it one to the right.  The axis
    on the right has the same zero as that of the torques or forces.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With the lines of the torques or forces and their limits.
    view : MotionView
    rows : mapping of int to int
        Rows of the actuators, with the numbers that determine their colours.
    unit : str
        Unit of the torques or forces, ``"N m"`` or ``"N"``.
    """
    drawn = [
        (event.time, stage.moment, row, float(stage.impulse[row]))
        for event in view.events
        for stage in event.actuator_impulses
        for row in rows
        if stage.impulse[row]
    ]
    if not drawn:
        return
    right = axes.twinx()
    right.set(label=_name_axis(axes), ylabel="" if _is_narrow(axes) else f"impulse\n[{unit} s]")  # the legend states it
    right.grid(visible=False)
    right.spines["right"].set_visible(True)
    right.locator_params(axis="y", nbins=3 if _is_narrow(axes) else 5)
    for time, moment, row, value in drawn:
        _draw_stem(right, time, moment, value, line_style(rows[row])["color"])
    _align_zeros(axes, right, np.array([value for *_, value in drawn]))
    for moment, caret in CARETS.items():
        colors = {line_style(rows[row])["color"] for _, each, row, _ in drawn if each == moment}
        if colors:
            color = colors.pop() if len(colors) == 1 else "0.3"
            label = f"impulse {moment} impact [{unit} s]"
            axes.plot([], [], marker=caret, label=label, color=color, markersize=6, linewidth=1.5)


def widen_legend_space(axes: "Axes") -> dict[str, Any]:
    """Return the keywords of a legend above a panel that has an axis of impulses: it ends above the label of that axis.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        A panel; without an axis of impulses the result is empty.
    """
    from matplotlib.transforms import ScaledTranslation

    figure = root_figure(axes)
    if figure is None or all(each.get_label() != _name_axis(axes) for each in figure.axes):
        return {}
    width = (NUMBERS_WIDTH if _is_narrow(axes) else AXIS_WIDTH) * float(axes.yaxis.label.get_fontsize()) / 72
    return {"bbox_transform": axes.transAxes + ScaledTranslation(width, 0, figure.dpi_scale_trans)}


def _is_narrow(axes: "Axes") -> bool:
    """Return whether axes belong to a figure of the width of a column."""
    figure = root_figure(axes)
    return figure is not None and figure.get_figwidth() < NARROW


def _name_axis(axes: "Axes") -> str:
    """Return the label of the axis of impulses of a panel."""
    return f"{axes.get_label()} impulses"


def _draw_stem(axes: "Axes", time: float, moment: Moment, value: float, color: Any) -> None:
    """Draw a line from zero to an impulse, with its mark."""
    from matplotlib.transforms import ScaledTranslation

    figure = axes.figure
    shift = ScaledTranslation(OFFSET[moment] / 72, 0, figure.dpi_scale_trans)
    style: dict[str, Any] = {"color": color, "transform": axes.transData + shift, "clip_on": False}
    axes.plot([time, time], [0, value], linewidth=1.5, zorder=5, **style)
    axes.plot([time], [value], marker=CARETS[moment], markersize=6, linestyle="none", zorder=6, **style)


def _align_zeros(left: "Axes", right: "Axes", values: Array) -> None:
    """Limit both axes so that their zeros have one height and all impulses are visible."""
    low, high = left.get_ylim()
    low, high = min(low, 0.0), max(high, 0.0)
    if values.max() > 0:
        high = max(high, -LEAST_SHARE * low)
    if values.min() < 0:
        low = min(low, -LEAST_SHARE * high)
    scale = max(value / (high if value > 0 else low) for value in values.tolist())
    left.set_ylim(low, high)
    right.set_ylim(HEADROOM * scale * low, HEADROOM * scale * high)
