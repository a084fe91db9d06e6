"""Maps of regions: a colour for each kind of outcome over two parameters."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.motion.motion import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

EMPTY = "no gait"
"""Label of points without a kind, which remain white."""


FRAME: dict[str, Any] = {"edgecolor": "0.4", "linewidth": 0.5}
"""Frame of a handle of the legend."""


def empty_patch(label: str = EMPTY) -> "Patch":
    """Return the handle of points without a kind."""
    from matplotlib.patches import Patch

    return Patch(facecolor="white", label=label, **FRAME)


def draw_regions(
    axes: "Axes", places: tuple[Array, Array], kinds: Any, colors: Mapping[str, str], *, empty: str = EMPTY
) -> "list[Patch]":
    """Draw the kind at each point of a grid as a colour, and return the handles of the legend.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    places : (K,) array, (L,) array
        Coordinates of the points.
    kinds : (K, L) int array
        Number of the kind, -1 for none.
    colors : mapping of str to str
        Colour of each kind by its label, in the order of the numbers.
    empty : str
        Label of points of no kind.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    shown = np.ma.masked_less(np.asarray(kinds).T, 0)
    look: dict[str, Any] = {"vmin": -0.5, "vmax": len(colors) - 0.5, "shading": "nearest", "rasterized": True}
    axes.pcolormesh(*places, shown, cmap=ListedColormap(list(colors.values())), **look)
    axes.grid(visible=False)
    handles = [
        Patch(facecolor=color, label=label, **FRAME)
        for number, (label, color) in enumerate(colors.items())
        if np.any(kinds == number)
    ]
    if np.any(np.asarray(kinds) < 0):
        handles.append(empty_patch(empty))
    return handles
