"""The figure of a front: the cost over each other quantity, with the knee of the front."""

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.quantity_labels import label_quantity
from gaitopt.plot.gait_title import list_settings
from gaitopt.plot.legends import LETTERS_PER_INCH, NO_BREAK, wrap_text
from gaitopt.plot.style import FigureStyle, begin_at_zero, line_style
from gaitopt.plot.sweep_figure import TARGETS, list_targets

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@check_arguments
def plot_front(front: "xr.Dataset", *, style: FigureStyle | None = None) -> "Figure":
    """Draw the cost of a front over each of its other quantities, side by side.

    Gaits that no other gait dominates are filled marks, joined by a line if there is one bounded quantity; dominated
    ones are small open marks.  The knee has a ring.

    Parameters
    ----------
    front : xarray.Dataset
        From :meth:`gaitopt.Pareto.trace` or :func:`gaitopt.study.load_front`.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the front has no solved gait.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> columns = {"cost": [1.0, 2.0, 4.0], "peak_torque": [6.0, 3.0, 2.0], "front": [1, 1, 1], "knee": [0, 1, 0]}
    >>> table = xr.Dataset({name: ("point", values) for name, values in columns.items()})
    >>> figure = plot_front(table.assign_attrs(objectives=["cost", "peak_torque"], objective="cost_of_transport"))
    >>> figure.axes[0].get_ylabel()
    'cost of transport'
    """
    names = [str(name) for name in front.attrs["objectives"]]
    cost, member, knee = front.cost.values, front.front.values == 1, front.knee.values == 1
    if not member.any():
        raise InputError("The front has no solved gait to draw.")
    style = style or FigureStyle()
    color = line_style(0)["color"]
    bounded = sum(str(name).startswith("bound_") for name in front.data_vars)
    with style.figure(3.2) as figure:
        panels = figure.subplots(1, len(names) - 1, sharey=True, squeeze=False)[0]
        for axes, name in zip(panels, names[1:], strict=True):
            values = front[name].values
            order = np.flatnonzero(member)
            axes.plot(values[order], cost[order], "o" if bounded > 1 else "o-", color=color, markersize=3.5)
            open_mark: dict[str, Any] = {"color": color, "markerfacecolor": "white", "markersize": 3}
            axes.plot(values[~member], cost[~member], "o", label="dominated" if np.any(~member) else None, **open_mark)
            ring: dict[str, Any] = {"color": "0.15", "markerfacecolor": "none", "markersize": 9}
            axes.plot(values[knee], cost[knee], "o", label="knee" if knee.any() else None, **ring)
            begin_at_zero(axes)
            axes.set_xlabel(label_quantity(name, front[name].attrs.get("units", "1")))
        if style.titled and (title := _describe_front(front, int(LETTERS_PER_INCH * style.width))):
            figure.suptitle(title, fontsize=style.font_size)
        panels[0].set_ylabel(label_quantity(front.attrs["objective"], front.cost.attrs.get("units", "1")))
        handles, labels = panels[0].get_legend_handles_labels()
        if handles:
            panels[0].legend(handles, labels, loc="best")
    return figure


def _describe_front(front: "xr.Dataset", letters: int) -> str:
    """Return robot, contact sequence and fixed targets of a front, and the parameters that were set."""
    problem = json.loads(front.attrs.get("question", "{}")).get("problem", {})
    robot = str(problem.get("robot", "")).replace("_", " ")
    fixed = {name: value for name, value in problem.items() if name not in front.attrs["objectives"]}
    targets = list_targets(front, fixed)
    texts = [part for part in (robot, str(problem.get("sequence", "")), *targets) if part]
    stated = {name for name in TARGETS if any(text.startswith(name.replace("_", NO_BREAK)) for text in targets)}
    settings = list_settings(
        json.loads(front.attrs.get("script", "null")), letters, {*stated, *front.attrs["objectives"], "sequence"}
    )
    return wrap_text(", ".join(texts), letters) + settings
