"""Placement of a planar robot on some of its contacts, from a part of its coordinates and rates."""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.terrain import Terrain, separate_terrain
from gaitopt.motion.motion import Array

ITERATIONS, ACCURACY = 20, 1e-14
"""Largest number of Newton iterations, and the largest gap that remains [m]."""


@check_arguments
def place_planar(
    robot: PlanarRobot,
    coordinates: Mapping[str, float],
    rates: Mapping[str, float],
    parameters: Mapping[str, float | Terrain | None],
    *,
    on: Sequence[str],
    sliding: bool = False,
) -> tuple[Array, Array]:
    """Return the state of a robot that stands on some contacts.

    The coordinates that are not given are those with the least change from zero at which the gaps of these contacts are
    zero, and the rates that are not given those of least size at which the contacts do not move.

    Parameters
    ----------
    robot : PlanarRobot
    coordinates, rates : mapping of str to float
        Some coordinates and some rates, both by the names of the coordinates [m, rad; m/s, rad/s].
    parameters : mapping of str to float
        ``"terrain"`` may be a :class:`~gaitopt.model.Terrain`.
    on : sequence of str
        Closed contacts.
    sliding : bool
        Whether the contacts may slide, so that only their normal velocities are zero.

    Returns
    -------
    q, v : (n_q,) arrays

    Raises
    ------
    InputError
        If a name is unknown, or no such state exists.

    Examples
    --------
    >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
    >>> robot = compass_with_two_feet()
    >>> q, v = place_planar(robot, {"x": 0, "a": 0.2, "b": -0.2}, {"a": -1, "b": 0}, {}, on=["foot A"])
    >>> q.round(4).tolist(), v.round(4).tolist()
    ([0.0, 1.5681, 0.2, -0.2], [1.5681, 0.3179, -1.0, 0.0])
    """
    values, terrain = separate_terrain(parameters)
    p = robot.vector(robot.resolve(values))
    closed = [robot.contact_index(name) for name in on]
    q, free = _read(robot, coordinates, "coordinate")
    for _ in range(ITERATIONS):
        gap = _gaps(robot, q, p, terrain)[closed]
        if np.max(np.abs(gap), initial=0.0) < ACCURACY:
            break
        rows = np.array(robot.rows(q, np.zeros(robot.n_q), p)[0])[closed]
        q[free] -= np.linalg.lstsq(rows[:, free], gap, rcond=1e-12)[0]
    v, free = _read(robot, rates, "rate")
    normal, tangent = (np.array(part) for part in robot.rows(q, v, p)[:2])
    rows = normal[closed] if sliding else np.vstack([normal[closed], tangent[closed]])
    v[free] -= np.linalg.lstsq(rows[:, free], rows @ v, rcond=1e-12)[0]
    errors = [*_gaps(robot, q, p, terrain)[closed], *(rows @ v)]
    if np.max(np.abs(errors), initial=0.0) > 1e-9:
        raise InputError(
            f"Robot {robot.name!r} does not stand on {', '.join(on)} with coordinates {dict(coordinates)} and "
            f"rates {dict(rates)}: gaps [m] or velocities [m/s] of these contacts remain, up to "
            f"{np.max(np.abs(errors)):.3g}. Change or omit some of these values."
        )
    return q, v


def _gaps(robot: PlanarRobot, q: Array, p: Array, terrain: Terrain | None) -> Array:
    """Return the gap of each contact to the ground at its place, shape (n_c,) [m]."""
    gaps = np.array(robot.gaps(q, p)[0]).ravel()
    places = np.array(robot.rims(q, p))[0]
    heights = [0.0 if terrain is None or np.isnan(place) else terrain.height(place) for place in places]
    return np.asarray(gaps - heights)


def _read(robot: PlanarRobot, values: Mapping[str, float], kind: str) -> tuple[Array, list[int]]:
    """Return the given values in order, and the places of the others."""
    for name in values:
        if name not in robot.coordinates:
            raise InputError(f"Robot {robot.name!r} has no {kind} {name!r}. {suggest(name, robot.coordinates)}")
    vector = np.array([float(values.get(name, 0.0)) for name in robot.coordinates])
    return vector, [i for i, name in enumerate(robot.coordinates) if name not in values]
