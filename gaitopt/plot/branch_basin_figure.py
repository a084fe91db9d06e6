"""Figure of basins along a branch: shares of the endings and sizes of fatal pushes over the parameter."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity
from gaitopt.plot.basin_figure import ending_looks, name_ending
from gaitopt.plot.branch_figure import add_titled_legend, angle_symbol_of
from gaitopt.plot.region_map import HATCH
from gaitopt.plot.style import FigureStyle, line_style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOG_RANGE = 10.0
"""Ratio of the largest to the smallest push above which the axis is logarithmic."""

SIGNS = {"backward": "\N{MINUS SIGN}", "forward": "+"}
"""Sign of the change of a coordinate by side."""


@check_arguments
def plot_branch_basin(table: "xr.Dataset", *, style: FigureStyle | None = None) -> "Figure":
    r"""Draw basins along a branch over the parameter.

    The upper panel shows the shares of the starts with each ending, the lower one the size of the smallest fatal push
    in any direction and of those along each coordinate.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.study.trace_basin`.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the dataset is not that of basins along a branch.

    Examples
    --------
    >>> import math
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> from gaitopt.stability.recovery import PushTest
    >>> from gaitopt.study import PushSearch, trace_basin
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.95)})
    >>> search = PushSearch(radii=3)
    >>> table = trace_basin(wheel, diagram, [1.0, 0.97], balls=PushTest(starts=4), search=search)
    >>> [axes.get_ylabel() for axes in plot_branch_basin(table).axes]
    ['share of the starts', 'fatal push [rad/s]']
    """
    if not {"share", "push", "edge"} <= set(table.data_vars):
        raise InputError("The dataset must be that of basins along a branch, as trace_basin returns it.")
    (over,) = map(str, table.push.dims)
    unit = str(table[over].attrs.get("units", "1"))
    order = np.argsort(table[over].values)
    table, style = table.isel({over: order}), style or FigureStyle()
    values = in_shown_unit(table[over].values, unit)
    with style.figure(4.6) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        _draw_shares(upper, table, values)
        _draw_pushes(lower, table, values)
        lower.set_xlabel(label_quantity(over, unit))
        figure.align_ylabels()
        entries = [axes.get_legend_handles_labels() for axes in (upper, lower)]
        handles, labels = ([*one, *other] for one, other in zip(*entries, strict=True))
        robot = str(table.attrs.get("title", "")).partition(":")[0].replace("_", " ")
        add_titled_legend(figure, handles, labels, robot * style.titled, style)
    return figure


def _draw_shares(axes: "Axes", table: "xr.Dataset", values: np.ndarray) -> None:
    """Draw the shares of the endings as stacked areas."""
    labels = [str(label) for label in table.ending.values]
    looks = ending_looks(labels)
    areas = axes.stackplot(values, table.share.values.T, labels=[name_ending(label) for label in labels])
    for area, label in zip(areas, labels, strict=True):
        area.set(**HATCH | {"facecolor": looks[label].color, "hatch": looks[label].hatch})
    axes.set(ylabel="share of the starts", ylim=(0, 1))
    axes.margins(x=0)


def _draw_pushes(axes: "Axes", table: "xr.Dataset", values: np.ndarray) -> None:
    """Draw the sizes of the smallest fatal pushes, in any direction and along each coordinate."""
    number = 1
    for name in table.coordinate.values:
        for side in table.side.values:
            sizes = table.edge.sel(coordinate=name, side=side).values
            if not np.any(np.isfinite(sizes)):
                continue
            finite = np.where(np.isfinite(sizes), sizes, math.nan)
            label = f"{angle_symbol_of(str(name))} {SIGNS[str(side)]}"
            look: dict[str, Any] = line_style(number) | {"linewidth": 1.0, "zorder": 2.5}  # visible on an equal curve
            axes.plot(values, finite, label=label, **look)
            number += 1
    push = np.where(np.isfinite(table.push.values), table.push.values, math.nan)
    axes.plot(values, push, color="black", marker=".", clip_on=False, label="any direction")
    axes.set_ylabel("fatal push [rad/s]")
    low, high = axes.dataLim.intervaly
    if low > 0 and high > LOG_RANGE * low:
        axes.set_yscale("log")
