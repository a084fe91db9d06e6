"""Maps of regions: a colour for each kind of outcome over two parameters."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitopt.motion.motion import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

EMPTY = "no gait"
"""Label of points without a kind, which remain white."""


FRAME: dict[str, Any] = {"edgecolor": "0.4", "linewidth": 0.5}
"""Frame of a handle of the legend."""

HATCH: dict[str, Any] = {"facecolor": "none", "edgecolor": "0.25", "linewidth": 0}
"""Look of the hatches of a region."""


class AreaLook(NamedTuple):
    """Colour and hatch of a region; the hatch distinguishes regions in grey print."""

    color: str
    hatch: str = ""

    @property
    def handle(self) -> dict[str, Any]:
        """Keywords of a patch of the legend."""
        return {"facecolor": self.color, "hatch": self.hatch} | FRAME


def empty_patch(label: str = EMPTY) -> "Patch":
    """Return the handle of points without a kind."""
    from matplotlib.patches import Patch

    return Patch(facecolor="white", label=label, **FRAME)


def draw_regions(
    axes: "Axes", places: tuple[Array, Array], kinds: Any, looks: Mapping[str, AreaLook], *, empty: str = EMPTY
) -> "list[Patch]":
    """Draw the kind at each point of a grid as a colour and a hatch, and return the handles of the legend.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    places : (K,) array, (L,) array
        Coordinates of the points.
    kinds : (K, L) int array
        Number of the kind, -1 for none.
    looks : mapping of str to AreaLook
        Look of each kind by its label, in the order of the numbers.
    empty : str
        Label of points of no kind.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    shown = np.ma.masked_less(np.asarray(kinds).T, 0)
    nearest: dict[str, Any] = {"shading": "nearest", "rasterized": True}
    colors = ListedColormap([look.color for look in looks.values()])
    axes.pcolormesh(*places, shown, cmap=colors, vmin=-0.5, vmax=len(looks) - 0.5, **nearest)
    axes.grid(visible=False)
    handles = []
    for number, (label, look) in enumerate(looks.items()):
        if not np.any(kinds == number):
            continue
        handles.append(Patch(label=label, **look.handle))
        if look.hatch:
            axes.pcolor(*places, np.ma.masked_not_equal(shown, number), **nearest).set(hatch=look.hatch, **HATCH)
    if np.any(np.asarray(kinds) < 0):
        handles.append(empty_patch(empty))
    return handles
