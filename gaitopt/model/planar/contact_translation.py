"""Check that the contacts of a planar robot with the ground move with its bodies."""

import numpy as np
from numpy.typing import NDArray

from gaitopt.model.planar.planar_robot import PlanarRobot

Vector = NDArray[np.float64]

TOLERANCE = 1e-9
"""Largest relative error of the motion of a correct contact."""

DIRECTIONS = ("moved forward along the ground", "lifted off the ground")


def describe_detached_contacts(robot: PlanarRobot, q: Vector, p: Vector) -> tuple[str, ...]:
    """Return a sentence for each contact with the ground that does not move with the bodies.

    With the mass matrix M and the linear momentum A v, the columns of M^-1 A^T translate all bodies by 1 m, if the
    coordinates allow such a translation: otherwise A M^-1 A^T is less than the total mass, and nothing is checked.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> robot = monopod()
    >>> describe_detached_contacts(robot, np.full(5, 0.3), robot.vector(robot.resolve({})))
    ()
    """
    rest, units = np.zeros(robot.n_q), np.eye(robot.n_q)
    momentum = np.column_stack([np.array(robot.momentum(q, unit, p)[0]).ravel() for unit in units])
    translation = np.linalg.solve(np.array(robot.dynamics(q, rest, p)[0]), momentum.T)
    moved = np.diag(momentum @ translation) / float(robot.mass(p))
    normal, tangent = (np.array(rows) @ translation for rows in robot.rows(q, rest, p)[:2])
    faults = []
    for i, contact in enumerate(robot.contacts):
        for k in range(2):
            actual, expected = (tangent, normal)[k][i], np.eye(2)[k]
            applies = not contact.is_stop and (k == 1 or contact.slides) and moved[k] > 1 - TOLERANCE
            if applies and abs(actual[k] - expected[k]) > TOLERANCE:
                faults.append(_describe(robot.name, contact.name, k, actual[k]))
                break
    return tuple(faults)


def _describe(robot: str, contact: str, direction: int, moved: float) -> str:
    what = ("slide coordinate", "gap")[direction]
    return (
        f"Robot {robot!r}: contact {contact!r} does not move with the bodies: if all of them are "
        f"{DIRECTIONS[direction]} by 1 m, its {what} changes by {moved:.3g} m. Define its position in the same "
        "frame as the positions of the bodies, with y pointing away from the ground."
    )
