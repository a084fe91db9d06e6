"""Style, lines and legends shared by the figures of the studies."""

import numpy as np
from matplotlib.lines import Line2D

from gaitopt import FigureStyle, Mode

STYLE = FigureStyle()

GAIT_STYLE = {
    "A": {"color": "#0072B2", "linestyle": "-"},
    "B": {"color": "#D55E00", "linestyle": (0, (5, 1.5))},
    "C": {"color": "#009E73", "linestyle": (0, (5, 1.5, 1, 1.5))},
    "D+": {"color": "#AA4499", "linestyle": "-"},
    "D\N{MINUS SIGN}": {"color": "#AA4499", "linestyle": (0, (1.5, 1))},
}
"""Okabe and Ito's colours, which colour-blind readers can distinguish, with dashes for grey print."""

JUMP_LINE = {"color": "0.55", "linewidth": 0.9, "linestyle": (0, (3, 2)), "label": "impact and leg exchange"}
STICK_LINE = {"color": "0.2", "linewidth": 1.3}
SLIP_WIDTH = 2.6

TERMS = (
    ("impact_loss", 1, "impact", "#4D4D4D", ""),
    ("friction_loss", 1, "friction", "#E69F00", "///"),
    ("braking_work", 2, "2 \N{MULTIPLICATION SIGN} braking", "#9C86BF", "..."),
)
"""Terms of the absolute work of the motors on level ground: name, factor, label, colour, hatch."""


def draw_by_mode(axes, horizontal, vertical, modes):
    """Plot the phases of a path: sticking phases thin and dark, slip phases wide and coloured by direction."""
    for x, y, mode in zip(horizontal, vertical, modes, strict=True):
        style = {"color": STYLE.mode_fill[mode], "linewidth": SLIP_WIDTH} if mode.slips else STICK_LINE
        axes.plot(x, y, solid_capstyle="butt", **style)


def draw_jump(axes, start, end):
    """Plot the jump of an impact as a thin dashed line with an arrow at its midpoint."""
    (x0, y0), (x1, y1) = start, end
    axes.plot([x0, x1], [y0, y1], zorder=1, **JUMP_LINE)
    middle, beyond = np.array([x0 + x1, y0 + y1]) / 2, 0.02 * np.array([x1 - x0, y1 - y0])
    axes.annotate(
        "",
        xy=tuple(middle + beyond),
        xytext=tuple(middle - beyond),
        arrowprops={"arrowstyle": "-|>", "color": "0.55", "linewidth": 0.9, "mutation_scale": 9},
    )


def stack_terms(axes, shift, width, heights):
    """Plot stacked bars of the terms of the motors' work at 0, 1, ..., with negative terms below zero."""
    places, tops = np.arange(len(heights[0])) + shift, {True: 0.0, False: 0.0}
    for (_, _, label, color, hatch), height in zip(TERMS, heights, strict=True):
        for up in (True, False):
            part = np.where((height > 0) == up, height, 0.0)
            style = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.5}
            bars = axes.bar(places, part, width, bottom=tops[up], label=label if up else None, **style)
            for bar in bars:
                bar.sticky_edges.y.clear()
            tops[up] = tops[up] + part


def key_of_modes(figure, modes=(Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD), *others):
    """Add a legend of the contact modes, and of other lines, below a figure."""
    handles = [Line2D([], [], label="stick", **STICK_LINE)]
    handles += [Line2D([], [], color=STYLE.mode_fill[mode], linewidth=SLIP_WIDTH, label=mode.label) for mode in modes]
    handles += [Line2D([], [], **line) for line in others]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def format_sequence(sequence):
    """Return a contact sequence with true minus signs."""
    return str(sequence).replace("-", "\N{MINUS SIGN}")
