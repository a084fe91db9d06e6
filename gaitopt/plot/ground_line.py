"""The ground in pictures: its profile as a line, and patches of other friction as bands below it."""

from typing import TYPE_CHECKING

import numpy as np

from gaitopt.model.terrain import Piece, Terrain
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.motion import Array
from gaitopt.plot.style import GROUND, PATCH

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAND = 4.0
"""Width of the band of a patch, in widths of the line of the ground."""


def find_profile(terrain: Terrain | None, begin: float, end: float) -> Array:
    """Return the corners of the ground's profile between two places, shape (2, K) [m]; a plane has no corners inside.

    Examples
    --------
    >>> find_profile(Terrain(steps=[(1.0, -0.1)]), 0.0, 2.0).tolist()
    [[0.0, 1.0, 1.0, 2.0], [0.0, 0.0, -0.1, -0.1]]
    """
    inside = [] if terrain is None else [piece for piece in terrain.pieces if piece.end > begin and piece.begin < end]
    if not inside:
        return np.array([[begin, end], [0.0, 0.0]])
    return np.hstack([_line_of(piece, begin, end) for piece in inside])


def _line_of(piece: Piece, begin: float, end: float) -> Array:
    """Return the ends of a piece between two places, shape (2, 2) [m]."""
    places = np.array([max(piece.begin, begin), min(piece.end, end)])
    height, grade = piece.line
    return np.array([places, height + grade * places])


def draw_ground(
    axes: "Axes",
    terrain: Terrain | None,
    ends: tuple[float, float],
    slope: float,
    *,
    shift: float = 0.0,
    width: float = 1.0,
) -> None:
    """Draw the ground between two places, shifted along the slope.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    terrain : Terrain or None
        None for a plane.
    ends : (float, float) [m]
    slope : float [rad]
    shift : float [m]
    width : float
        Width of the line [points].
    """
    aside = np.array([[shift], [0.0]])
    axes.plot(*tilt(find_profile(terrain, *ends) + aside, slope), color=GROUND, linewidth=width, zorder=1)
    for piece in () if terrain is None else terrain.pieces:
        begin, end = max(piece.begin, ends[0]), min(piece.end, ends[1])
        if piece.friction is not None and begin < end:
            band = _line_of(piece, begin, end) + aside
            axes.plot(*tilt(band, slope), color=PATCH, linewidth=BAND * width, zorder=0.9, solid_capstyle="butt")
