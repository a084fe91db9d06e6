"""Maps of the outcomes of walks, with one colour for each kind of outcome."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from rimless_setup import TYPES

from gaitopt.study import ending_labels

OUTCOMES = {
    "A": ("settles in Type A", "#9CC9E8"),
    "B": ("settles in Type B", "#F2B48C"),
    "C": ("settles in Type C", "#7CCBB0"),
    "D": ("settles in Type D", "#D9A6D3"),
    "fell": ("rolls back", "0.88"),
    "lift_off": ("lifts off", "0.62"),
    "no_touchdown": ("remains upright", "white"),
    "other": ("not settled", "#F5E663"),
}
"""Name and colour of each kind of outcome."""


def kind_of(label):
    """Return the kind of an outcome of a basin."""
    kind = TYPES.get(label, label)
    return kind if kind in OUTCOMES else "other"


def draw_map(axes, basin, across, upward):
    """Plot a basin of two axes over their values, in any unit, and return the handles of its legend."""
    kinds = np.vectorize(kind_of)(ending_labels(basin))
    order = list(OUTCOMES)
    numbers = np.vectorize(order.index)(kinds)
    axes.pcolormesh(
        across,
        upward,
        numbers.T,
        cmap=ListedColormap([color for _, color in OUTCOMES.values()]),
        vmin=-0.5,
        vmax=len(order) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    axes.set(xlim=(across[0], across[-1]), ylim=(upward[0], upward[-1]))
    axes.grid(False)
    for kind in "ABCD":
        places = np.argwhere(kinds == kind)
        if _extent(places[:, 0]) > 0.04 * across.size:  # large enough for a label
            column, row = places.mean(axis=0).astype(int)
            axes.text(across[column], upward[row], kind, ha="center", va="center", fontsize=11)
    return [
        Patch(facecolor=color, edgecolor="0.5", linewidth=0.5, label=name)
        for kind, (name, color) in OUTCOMES.items()
        if kind in kinds
    ]


def _extent(numbers):
    return numbers.max() - numbers.min() if numbers.size else 0
