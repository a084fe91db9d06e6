"""The figure of curves of special points: the map of the regions of gait types in the plane of two parameters."""

from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram, name_sides
from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.errors import InputError
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity
from gaitopt.plot.branch_figure import add_titled_legend, describe_diagram
from gaitopt.plot.style import FigureStyle, line_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CODIMENSION_TWO = "codimension two"
"""Label of the points at which curves end."""

ANGLES = ("slope",)
"""Angles in files of earlier versions, which lack the units of the parameters."""


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
            _draw_curve(axes, diagram, curve, number)
        shown = diagram.curves[0]
        first, second = (label_quantity(name, _unit(diagram, shown, k)) for k, name in enumerate(shown.parameters))
        axes.set(xlabel=second, ylabel=first)
        handles, labels = axes.get_legend_handles_labels()
        entries = dict(zip(labels, handles, strict=True))
        if CODIMENSION_TWO in entries:  # after all curves
            entries[CODIMENSION_TWO] = entries.pop(CODIMENSION_TWO)
        title = describe_diagram(diagram, style.width, shown.parameters) * style.titled
        add_titled_legend(figure, list(entries.values()), list(entries), title, style, columns=1)
    return figure


def _draw_curve(axes: "Axes", diagram: BranchDiagram, curve: SpecialCurve, number: int) -> None:
    """Draw a curve, and the points of codimension two at its ends."""
    first, second = (in_shown_unit(curve.values[:, k], _unit(diagram, curve, k)) for k in range(2))
    before, after = name_sides(curve.before, curve.after)
    change = before if before == after else f"{before} \N{RIGHTWARDS ARROW} {after}"
    line: dict[str, Any] = {"color": line_style(number)["color"], "linewidth": 1.4}
    axes.plot(second, first, label=f"{curve.kind.label}: {change}", **line)
    for place, codimension_two in zip((0, -1), curve.codimension_two, strict=True):
        if codimension_two:
            axes.plot(second[place], first[place], "D", color="0.15", markersize=4.5, label=CODIMENSION_TWO, zorder=5)


def _unit(diagram: BranchDiagram, curve: SpecialCurve, number: int) -> str:
    """Return the unit of a parameter of a curve, also of files of earlier versions, which may lack it."""
    name = curve.parameters[number]
    return curve.units[number] or ("rad" if name in ANGLES else diagram.unit if name == diagram.parameter else "")
