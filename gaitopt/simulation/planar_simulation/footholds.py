"""The pieces of a terrain on which the closed contacts of a planar robot stand."""

from collections.abc import Sequence

import numpy as np

from gaitopt.model.planar.phase_system import GuardKind
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.terrain import Terrain
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.planar_state import PlanarState

EDGE = 1e-8
"""Distance from a change of the terrain within which a contact may belong to either side [m]."""

LEVEL = 1e-7
"""Largest distance of a closing contact from the ground [m]; a larger one is the front of a step."""

Pieces = tuple[int | None, ...]


def find_pieces(
    terrain: Terrain, state: PlanarState, closed: Sequence[int], places: Array, levels: Array
) -> tuple[int | None, ...]:
    """Return the number of the piece under each closed contact, None for others.

    A contact stays on its piece until it opens or crosses to the next one.  Near a change of the terrain a new contact
    belongs to the side with its height.

    Parameters
    ----------
    terrain : Terrain
    state : PlanarState
    closed : sequence of int
    places, levels : (n_c,) arrays
        Place along the ground and height of each contact [m].
    """
    known = state.pieces or (None,) * len(places)
    pieces: list[int | None] = [None] * len(places)
    for i in closed:
        if np.isfinite(places[i]):
            near = [terrain.piece_at(places[i] + side) for side in (0.0, -EDGE, EDGE)]
            best = min(near, key=lambda number: abs(terrain.pieces[number].height - levels[i]) > LEVEL)
            pieces[i] = best if known[i] is None else known[i]
    return tuple(pieces)


def hits_step(terrain: Terrain, place: float, level: float) -> bool:
    """Return whether a closing contact at some place and height [m] hits the front of a step.

    Examples
    --------
    >>> terrain = Terrain(steps=[(1.0, 0.1)])
    >>> hits_step(terrain, 1.0, 0.04), hits_step(terrain, 1.2, 0.1)
    (True, False)
    """
    heights = [terrain.pieces[terrain.piece_at(place + side)].height for side in (-EDGE, EDGE)]
    return bool(np.isfinite(place)) and min(abs(level - height) for height in heights) > LEVEL


def is_uneven(robot: PlanarRobot, terrain: Terrain, pieces: Pieces) -> bool:
    """Return whether two contacts of one body stand on different heights."""
    heights: dict[str, float] = {}
    for contact, number in zip(robot.contacts, pieces, strict=False):
        if number is not None:
            height = terrain.pieces[number].height
            if heights.setdefault(contact.body, height) != height:
                return True
    return False


def cross_piece(terrain: Terrain, pieces: Pieces, kind: GuardKind) -> Pieces | None:
    """Return the pieces after a contact crosses to the next one; None if that one is higher.

    A contact that crosses a step down has no piece: it is free.

    Examples
    --------
    >>> cross_piece(Terrain(patches=[(0, 1, 0.1)]), (1, None), GuardKind("crosses+", 0))
    (2, None)
    """
    contact = kind.number
    old = pieces[contact]
    if old is None:
        raise ValueError("a free contact does not cross")
    new = old + (1 if kind.name == "crosses+" else -1)
    rise = terrain.pieces[new].height - terrain.pieces[old].height
    return None if rise > 0 else (*pieces[:contact], new if rise == 0 else None, *pieces[contact + 1 :])
