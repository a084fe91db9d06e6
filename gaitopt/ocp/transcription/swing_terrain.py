"""The swing foot over a terrain: its height above the profile of the ground between its footprints."""

import math

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.model.coordinate_entries import GAP, SLIDE
from gaitopt.model.terrain import Terrain
from gaitopt.model.uneven_ground import stance_rotation
from gaitopt.ocp.nlp.layout import Index

WIDTH, ROUNDING = 0.05, 1e-3
"""Width of the smooth transition in front of a step up or behind a step down, and radius of the ends of ramps [m]."""

DEEPEST = 0.1
"""Accepted depth of the swing foot below the terrain where straight legs pass each other [m]."""

SLACK = 1e-5
"""Accepted depth of the swing foot below the smooth profile [m]."""


@dataclass(frozen=True, eq=False)
class SwingTerrain:
    """The terrain below the swing foot of a step.

    Attributes
    ----------
    terrain : Terrain
    travels : (n,) int array
        Indices of the travels of the earlier steps, whose sum is the place of the stance foot, counted from the first
        unknown of the step.
    line : (float, float)
        Height at place 0 of the extended ground of the stance foot [m], and its grade.
    """

    terrain: Terrain
    travels: Index
    line: tuple[float, float]


def smooth_height(terrain: Terrain, place: ca.SX) -> ca.SX:
    """Return the height of a smooth profile of a terrain [m], at most slightly below the terrain near ends of ramps.

    The profile rises in front of a step up and falls behind a step down, but not beyond the neighbouring step; the
    ends of ramps are rounded.

    Examples
    --------
    >>> terrain = Terrain(steps=[(1.0, 0.1)])
    >>> [round(float(smooth_height(terrain, place)), 9) for place in (0.95, 0.975, 1.0)]
    [0.0, 0.05, 0.1]
    """
    height = ca.SX(0)
    places = [-math.inf, *(at for at, _ in terrain.steps), math.inf]
    for (at, rise), before, after in zip(terrain.steps, places[:-2], places[2:], strict=True):
        width = min(WIDTH, at - before if rise > 0 else after - at)
        begin = at - width if rise > 0 else at
        height += rise * smooth_step((place - begin) / width)
    for begin, end, rise in terrain.ramps:
        height += rise / (end - begin) * (_positive_part(place - begin) - _positive_part(place - end))
    return height


def smooth_step(part: ca.SX) -> ca.SX:
    """Return a function that rises from 0 at 0 to 1 at 1 with two continuous derivatives."""
    s = ca.fmin(ca.fmax(part, 0), 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _positive_part(distance: ca.SX) -> ca.SX:
    return (distance + ca.sqrt(distance**2 + ROUNDING**2)) / 2


def height_over_terrain(
    swing: SwingTerrain, place: ca.SX, incline: ca.SX, contact: ca.SX, foot: ca.SX, slid: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Return the distance of the swing foot ahead of the stance foot, and its height over the terrain [m].

    Parameters
    ----------
    swing : SwingTerrain
    place : SX
        Place of the stance foot at the start of the step [m].
    incline : SX
        Inclination of the ground at the stance foot [rad].
    contact : SX of shape (2, 1)
        Displacement of the stance foot in the phase, along and across its ground [m].
    foot : SX of shape (2, 1)
        Swing foot relative to the place of the stance foot at the start of the phase, along and across the plane [m].
    slid : SX of shape (2, 1)
        Displacement of the stance foot before the phase, along and across the plane [m].
    """
    ahead = foot - stance_rotation(incline) @ contact
    level, moved = swing.line[0] + swing.line[1] * place, foot + slid
    return ahead[SLIDE], level + moved[GAP] - smooth_height(swing.terrain, place + moved[SLIDE])
