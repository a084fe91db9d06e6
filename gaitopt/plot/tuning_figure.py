"""The figure of tuned gains: the objective over the search, and the multipliers of the tuned gait."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.plot.legends import add_page_legend
from gaitopt.plot.style import NARROW, FigureStyle, line_style
from gaitopt.tuning.record import Tuning
from gaitopt.tuning.tuning_file import TunedGains

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT = 2.8
"""Height of a panel [inch]."""

LARGEST_SHOWN, EXTENSION = 20.0, 1.5
"""Largest objective shown, as a multiple of the lowest one; height up to which an axis is extended for the open loop,
over its height without it."""


@check_arguments
def plot_tuning(tuned: Tuning | TunedGains, *, style: FigureStyle | None = None) -> "Figure":
    """Draw the search for gains: the objective of each trial, the lowest so far, and the multipliers at its end.

    Parameters
    ----------
    tuned : Tuning or TunedGains
        From :func:`gaitopt.tune_feedback`, or read from the file of tuned gains.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure
        The unit circle in the complex plane is the stability limit.

    Raises
    ------
    InputError
        If there are neither trials nor multipliers.

    Examples
    --------
    >>> from gaitopt.tuning.controller_family import FamilySettings
    >>> from gaitopt.tuning.record import Trial
    >>> trials = (Trial({"stiffness": 20.0}, 0.8), Trial({"stiffness": 30.0}, 0.5))
    >>> tuned = TunedGains(family="joint_pd", gains={"stiffness": 30.0}, settings=FamilySettings(), radius=0.5,
    ...                    objective="spectral radius", multipliers=(0.3 + 0.4j, 0.3 - 0.4j), trials=trials)
    >>> [axes.get_ylabel() for axes in plot_tuning(tuned).axes]
    ['spectral radius', 'imaginary part']
    """
    if not tuned.trials and not tuned.multipliers:
        raise InputError("The tuned gains have neither trials nor multipliers to draw.")
    style = style or FigureStyle()
    narrow = style.width < NARROW
    with style.figure(HEIGHT * (1 + narrow)) as figure:
        shape = (2, 1) if narrow else (1, 2)
        ratios: dict[str, Any] = {"height_ratios": (1, 1.3)} if narrow else {"width_ratios": (1.5, 1)}
        search, plane = figure.subplots(*shape, **ratios)
        _draw_search(search, tuned)
        _draw_plane(plane, tuned)
        handles, labels = search.get_legend_handles_labels()
        add_page_legend(figure, handles, labels, columns=4, width=style.width, loc="outside upper center")
    return figure


def _draw_search(axes: "Axes", tuned: Tuning | TunedGains) -> None:
    from matplotlib.ticker import MaxNLocator

    values = np.array([trial.objective for trial in tuned.trials])
    numbers = np.arange(1, values.size + 1)
    lowest = np.minimum.accumulate(np.where(np.isfinite(values), values, np.inf))
    axes.plot(numbers, values, "o", color="0.6", markersize=2.5, label="each evaluation")
    axes.plot(numbers, np.where(np.isfinite(lowest), lowest, np.nan), **line_style(0), label="lowest so far")
    finite = values[np.isfinite(values)]
    largest = LARGEST_SHOWN * float(finite.min(initial=np.inf))
    top = min(float(finite.max(initial=0.0)), largest)
    if tuned.objective == "spectral radius":
        axes.axhline(1, label="stability limit", **FigureStyle.limit_line)
        top = max(top, 1.0)
        top = max(top, _draw_open_loop(axes, tuned.radius_before, max(EXTENSION * top, largest)))
    if finite.size:
        axes.set_ylim(0, 1.05 * top)
    axes.set(xlabel="evaluation", ylabel=tuned.objective)
    axes.xaxis.set_major_locator(MaxNLocator("auto", integer=True))  # evaluations are counted


def _draw_open_loop(axes: "Axes", radius: float, largest: float) -> float:
    """Draw the spectral radius in open loop and return it; 0 if it is too large, and stated above the axis."""
    if radius <= largest and math.isfinite(radius):
        axes.axhline(radius, label="open loop", linewidth=1, **line_style(1))
        return radius
    if math.isfinite(radius):
        text = f"\N{UPWARDS ARROW} open loop: {radius:.3g}"
        place: dict[str, Any] = {"ha": "right", "va": "bottom"}
        axes.annotate(text, (1, 1), (0, 3), "axes fraction", "offset points", **place)
    return 0.0


def _draw_plane(axes: "Axes", tuned: Tuning | TunedGains) -> None:
    """Draw the multipliers in the complex plane with the unit circle."""
    angle = np.linspace(0, 2 * np.pi, 181)
    axes.plot(np.cos(angle), np.sin(angle), label="_circle", **FigureStyle.limit_line)
    values = np.array(tuned.multipliers)
    axes.plot(values.real, values.imag, "o", color=line_style(0)["color"], markersize=5, label="_multiplier")
    reach = 1.1 * max(1.0, float(np.max(np.abs(values), initial=0.0)))
    axes.set(xlabel="real part", ylabel="imaginary part", xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.set_title("multipliers")
