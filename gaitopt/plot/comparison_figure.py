"""The figure of a comparison: gaits drawn over each other, and what their energy goes into."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.plot.panels import force_ratio
from gaitopt.plot.style import FigureStyle, angle_symbol, line_style
from gaitopt.study.comparison import Comparison, energy_per_distance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TERMS = (
    ("impact_loss", "impact", "#0072B2", ""),
    ("friction_loss", "friction", "#E69F00", "///"),
    ("twice_braking", "2 \N{MULTIPLICATION SIGN} braking", "#CC79A7", "..."),
    ("gravity", "\N{MINUS SIGN}gravity", "0.8", "\\\\\\"),
)
"""Terms of the energy per distance: name, label, colour, hatch."""


MOST_UPRIGHT, LEAST_ROWS = 2, 4
"""Bars whose labels have room side by side; rows that leave room for the bars' legend."""


def plot_comparison(comparison: Comparison, *, style: FigureStyle | None = None) -> "Figure":
    """Draw gaits over each other, over the percentage of the step, and their energy per distance as bars.

    Gaits of several robots are drawn by the angles and actuators that all of them have.

    Parameters
    ----------
    comparison : Comparison
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> from gaitopt import compare, load, plot_comparison
    >>> figure = plot_comparison(compare([load("docs/examples/compass_slip.h5")]))
    >>> [axes.get_ylabel() for axes in figure.axes][-1]
    'energy per distance [J/m]'
    """
    style = style or FigureStyle()
    motions = [gait.motion for gait in comparison.gaits.values()]
    angles = [name for name in motions[0].angles if all(name in motion.angles for motion in motions)]
    actuators = [name for name in motions[0].actuators if all(name in motion.actuators for motion in motions)]
    rows: list[tuple[str, Callable[[Gait], list[Array]]]] = [
        *((f"{angle_symbol(name)} [deg]", _angle(name)) for name in angles),
        *((f"{name} torque\n[N m]", _torque(name)) for name in actuators),
        ("force ratio", lambda gait: [force_ratio(segment) for segment in gait.motion.segments]),
        ("foot speed\n[m/s]", lambda gait: [segment.v[0] for segment in gait.motion.segments]),
    ]
    with style.figure(1.0 * max(len(rows), LEAST_ROWS) + 0.9) as figure:
        grid = figure.add_gridspec(len(rows), 2, width_ratios=(2.4, 1))
        left: list[Axes] = []
        for row, (label, read) in enumerate(rows):
            axes = figure.add_subplot(grid[row, 0], sharex=left[0] if left else None)
            left.append(axes)
            for number, gait in enumerate(comparison.gaits.values()):
                axes.plot(*_over_step(gait, read(gait)), **line_style(number), label=list(comparison.gaits)[number])
            axes.set_ylabel(label)
            axes.tick_params(labelbottom=row == len(rows) - 1)
        left[-1].set_xlabel("part of the step [%]")
        left[-1].set_xlim(0, 100)
        figure.align_ylabels(left)
        figure.legend(*left[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        _draw_energy(figure.add_subplot(grid[:, 1]), comparison)
    return figure


def _over_step(gait: Gait, parts: list[Array]) -> tuple[Array, Array]:
    """Return percentages of the step and values, with gaps where one segment ends and the next begins."""
    time = np.concatenate([np.append(segment.time, np.nan) for segment in gait.motion.segments])
    return 100 * time / gait.period, np.concatenate([np.append(part, np.nan) for part in parts])


def _angle(name: str) -> Callable[[Gait], list[Array]]:
    return lambda gait: [np.rad2deg(s.q[2 + gait.motion.angles.index(name)]) for s in gait.motion.segments]


def _torque(name: str) -> Callable[[Gait], list[Array]]:
    return lambda gait: [s.torque[gait.motion.actuators.index(name)] for s in gait.motion.segments]


def _draw_energy(axes: "Axes", comparison: Comparison) -> None:
    """Draw what each gait pays per distance, as a pile of its reasons."""
    terms = [energy_per_distance(gait) for gait in comparison.gaits.values()]
    places = np.arange(len(terms))
    above, below = np.zeros(len(terms)), np.zeros(len(terms))
    for name, label, color, hatch in TERMS:
        height = np.array([term[name] for term in terms])
        if np.allclose(height, 0, atol=1e-9):
            continue
        base = np.where(height > 0, above, below)
        axes.bar(places, height, 0.6, bottom=base, color=color, hatch=hatch, edgecolor="white", label=label)
        above, below = above + np.maximum(height, 0), below + np.minimum(height, 0)
    for place, term in zip(places, terms, strict=True):
        total = term["absolute_work"]
        axes.plot([place - 0.35, place + 0.35], [total, total], color="0.1", linewidth=1.2)
        axes.annotate(
            f"{total:#.3g}".rstrip("."),
            (place, above[place]),
            (0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
        )
    if len(terms) <= MOST_UPRIGHT:
        axes.set_xticks(places, [_folded(label) for label in comparison.gaits])
    else:
        axes.set_xticks(places, list(comparison.gaits), rotation=60, ha="right", rotation_mode="anchor")
    axes.set_ylabel("energy per distance [J/m]")
    axes.set_ylim(top=1.25 * max(above))
    axes.grid(visible=False, axis="x")
    axes.legend(loc="upper right", ncols=1, borderaxespad=0.2)


def _folded(label: str) -> str:
    """Return a label on several lines."""
    return label.replace(" | ", "\n| ").replace(", ", ",\n")
