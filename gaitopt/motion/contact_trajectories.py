"""Gaps, slide coordinates and rims of all contacts of a planar robot over time."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactTrajectories:
    """Position and speed of each contact at K instants; rows in the order of the robot's contacts.

    Attributes
    ----------
    gap : (n_c, K) array [m, or rad for the stop of an angle]
    slide : (n_c, K) array [m]
        Slide coordinate, constant while the contact sticks; zero for a stop.
    slip_speed : (n_c, K) array [m/s]
        Rate of the slide coordinate, which is the slip speed of a closed contact.
    rims : (4, n_c, K) array
        Centre [m], radius [m] and clockwise angle [rad] of each foot; nan for a stop.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> robot = monopod()
    >>> q, v = np.array([[0, 0.7, 0, 0, 0.6], [2.0, 0, 0, 0, 0]])[:, :, None]
    >>> hop = sample_contacts(robot, robot.resolve({}), q, v)
    >>> hop.gap.round(3).ravel().tolist(), hop.slip_speed.ravel().tolist()
    ([0.1, 0.7], [2.0, 2.0])
    """

    gap: Array
    slide: Array
    slip_speed: Array
    rims: Array


def sample_contacts(robot: "PlanarRobot", values: dict[str, float], q: Array, v: Array) -> ContactTrajectories:
    """Return the kinematics of all contacts for coordinates and rates, each of shape (n_q, K).

    Parameters
    ----------
    robot : PlanarRobot
    values : dict of str to float
        Every parameter by name.
    q, v : (n_q, K) arrays
    """
    count, n_c = q.shape[1], len(robot.contacts)
    p = robot.vector(values)
    gap, slide = (np.array(part, dtype=float) for part in robot.gaps.map(count)(q, p))
    tangent = np.array(robot.rows.map(count)(q, v, p)[1], dtype=float).reshape(n_c, count, robot.n_q)
    rims = np.array(robot.rims.map(count)(q, p), dtype=float).reshape(4, count, n_c)
    return ContactTrajectories(
        gap=gap,
        slide=slide,
        slip_speed=np.einsum("ckn,nk->ck", tangent, v),
        rims=np.ascontiguousarray(np.swapaxes(rims, 1, 2)),
    )
