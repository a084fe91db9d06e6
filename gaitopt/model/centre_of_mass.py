"""Position and velocity of the centre of mass relative to the stance foot."""

import functools

import casadi as ca

from gaitopt.model.coordinate_entries import CONTACT
from gaitopt.model.robot import Robot


@functools.lru_cache(maxsize=64)
def centre_of_mass(robot: Robot) -> ca.Function:
    """Return (q, v, p) -> offset (2) of the centre of mass from the stance foot [m] and velocity (2) [m/s].

    Both are in coordinates along and across the ground.  The offset is derived from the gravitational energy on ground
    of two slopes, the velocity from the momentum.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = compass_biped()
    >>> q, v = [0.3, 0, 0.1, 0.1], [0.5, 0, 1, 0]
    >>> offset, velocity = centre_of_mass(robot)(q, v, robot.vector(robot.resolve({})))
    >>> offset, velocity
    (DM([0.159733, 0.955204]), DM([1.77361, -0.127787]))
    """
    q, v, p = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("p", len(robot.parameters))
    slope = robot.index("slope")

    def height(angle: float) -> ca.SX:
        """Return the height of the centre of mass over the origin if the ground has a slope."""
        inclined = ca.SX(p)
        inclined[slope] = angle
        potential = robot.energy(q, v, inclined)[1] - robot.force_powers(q, v, inclined)[0]
        return potential / robot.weight(p)

    place = ca.vertcat(height(-ca.pi / 2), height(0))
    return ca.Function("centre_of_mass", [q, v, p], [place - q[CONTACT], robot.momentum(q, v, p)[0] / robot.mass(p)])
