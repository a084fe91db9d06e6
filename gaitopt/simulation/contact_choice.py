"""The exact choice of the contact mode of a foot on the ground."""

import casadi as ca
import numpy as np

from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array

REST = 1e-12
"""Foot speeds below this [m/s] count as rest; impacts and located events leave exact zeros."""


def choose_mode(robot: Robot, q: Array, v: Array, u: Array, p: Array, *, leaving: Mode | None = None) -> Mode:
    """Return the mode in which a foot on the ground goes on.

    A moving foot slides.  A foot at rest sticks if the sticking force lies in the friction cone; otherwise it slides
    against the excess of that force.

    Parameters
    ----------
    robot : Robot
    q, v : (n_q,) arrays
    u : (n_u,) array [N m]
    p : (n_p,) array
    leaving : Mode, optional
        A slip mode that has just come to rest and so cannot be chosen again.
    """
    if abs(v[0]) > REST:
        return Mode.slipping(v[0])
    force = np.asarray(robot.acceleration[Mode.STICK](q, v, u, p)[1]).ravel()
    friction = p[[parameter.name for parameter in robot.parameters].index("friction")]
    if np.isinf(friction) or abs(force[0]) <= friction * force[1]:
        return Mode.STICK
    chosen = Mode.slipping(-force[0])
    return Mode.STICK if chosen is leaving else chosen


def wellposed(robot: Robot, mode: Mode, q: Array, p: Array) -> bool:
    """Return whether slip in a mode is well posed (no Painleve paradox); sticking always is."""
    if not mode.slips:
        return True
    indicator = robot.wellposed(q, p)
    return float(ca.DM(indicator)[0 if mode.sign > 0 else 1]) > 0
