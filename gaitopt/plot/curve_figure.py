"""The figure of curves of special points: the map of the regions of gait types in the plane of two parameters."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram
from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.plot.legends import add_page_legend
from gaitopt.plot.style import FigureStyle, line_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ANGLES = ("slope",)
"""Parameters that are shown in degrees."""


@check_arguments
def plot_curves(diagram: BranchDiagram, *, style: FigureStyle | None = None) -> "Figure":
    """Draw the curves of special points of a diagram, which bound the regions of its gait types.

    A diamond marks a point of codimension two, at which a curve ends because it meets a special point of another kind.

    Parameters
    ----------
    diagram : BranchDiagram
        With curves, as `gaitopt trace --second` and :func:`gaitopt.continuation.trace_curve` compute them.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the diagram has no curves.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> from gaitopt.plot import plot_curves
    >>> plot_curves(load_diagram("docs/examples/compass_slope.nc"))
    Traceback (most recent call last):
    gaitopt.errors.InputError: The diagram has no curves of special points; compute them with --second or trace_curve.
    """
    if not diagram.curves:
        raise InputError("The diagram has no curves of special points; compute them with --second or trace_curve.")
    style = style or FigureStyle()
    with style.figure(4.6) as figure:
        axes = figure.subplots()
        for number, curve in enumerate(diagram.curves):
            _draw_curve(axes, curve, number)
        first, second = diagram.curves[0].parameters
        axes.set(xlabel=_label(second, diagram), ylabel=_label(first, diagram))
        handles, labels = axes.get_legend_handles_labels()
        entries = dict(zip(labels, handles, strict=True))
        add_page_legend(
            figure, list(entries.values()), list(entries), columns=1, width=style.width, loc="outside upper left"
        )
    return figure


def _draw_curve(axes: "Axes", curve: SpecialCurve, number: int) -> None:
    """Draw a curve, and the points of codimension two at its ends."""
    first, second = (_in_unit(curve.values[:, k], name) for k, name in enumerate(curve.parameters))
    change = curve.before if curve.before == curve.after else f"{curve.before} \N{RIGHTWARDS ARROW} {curve.after}"
    line: dict[str, Any] = {"color": line_style(number)["color"], "linewidth": 1.4}
    axes.plot(second, first, label=f"{curve.kind.label}: {change}", **line)
    for place, reason in ((0, curve.begin), (-1, curve.end)):
        if is_meeting(reason):
            axes.plot(second[place], first[place], "D", color="0.15", markersize=4.5, label="codimension two", zorder=5)


def is_meeting(reason: str) -> bool:
    """Return whether a curve ends because it meets a special point of another kind.

    Examples
    --------
    >>> is_meeting("meets impact cone"), is_meeting("range_end")
    (True, False)
    """
    return reason.startswith(("meets", "the gait before it becomes"))


def _in_unit(values: Array, name: str) -> Array:
    return np.degrees(values) if name in ANGLES else values


def _label(name: str, diagram: BranchDiagram) -> str:
    unit = "deg" if name in ANGLES else diagram.unit if name == diagram.parameter and diagram.unit != "rad" else ""
    return name.replace("_", " ") + ("" if unit in ("", "1") else f" [{unit}]")
