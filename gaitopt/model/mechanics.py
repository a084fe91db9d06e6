"""Equations of motion of a planar mechanism made of point masses and rigid links.

They read  M(q) a + h(q, v) = W^T f + E tau  with q = (x, y, angles); (x, y) is the stance foot, so
W = [I 0] and the contact force f = (f_t, f_n) enters the first two rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from gaitopt.model.forces import Force, Potential, RotorInertia, Spring


@dataclass(frozen=True, eq=False)
class PointMass:
    """A mass at a point.

    Attributes
    ----------
    mass : SX or float
        Mass [kg].
    position : SX, shape (2, 1)
        Position in the slope-fixed frame [m].

    Examples
    --------
    >>> import casadi as ca
    >>> angle = ca.SX.sym("angle")
    >>> PointMass(2.0, ca.vertcat(ca.sin(angle), ca.cos(angle))).position.shape
    (2, 1)
    """

    mass: ca.SX
    position: ca.SX


@dataclass(frozen=True, eq=False)
class RigidLink:
    """A rigid body with rotary inertia.

    Attributes
    ----------
    mass : SX or float
        Mass [kg].
    position : SX, shape (2, 1)
        Position of the centre of mass [m].
    inertia : SX or float
        Moment of inertia about the centre of mass [kg m^2].
    angle : SX
        Orientation [rad].

    Examples
    --------
    >>> import casadi as ca
    >>> angle = ca.SX.sym("angle")
    >>> RigidLink(2.0, ca.vertcat(ca.sin(angle), ca.cos(angle)), 0.1, angle).inertia
    0.1
    """

    mass: ca.SX
    position: ca.SX
    inertia: ca.SX
    angle: ca.SX


Body = PointMass | RigidLink


@dataclass(frozen=True, eq=False)
class Mechanics:
    """Symbolic mechanics of a mechanism, all expressions of (q, v, parameters).

    Attributes
    ----------
    mass_matrix : SX, shape (n_q, n_q)
    bias : SX, shape (n_q, 1)
        Coriolis and gravity terms h [N, N m].
    kinetic, potential : SX
        Energies [J].
    momentum : SX, shape (2, 1)
        Linear momentum [kg m/s], summed over the bodies, independent of the mass matrix.
    angular_momentum : SX
        Angular momentum about the origin of the frame [kg m^2/s], positive for increasing angle (clockwise).
    total_mass : SX
        Total mass [kg].
    elastic : SX
        Energy of springs and potentials, part of `potential` [J].
    dissipation : SX
        Power dissipated by dampers [W].
    """

    mass_matrix: ca.SX
    bias: ca.SX
    kinetic: ca.SX
    potential: ca.SX
    momentum: ca.SX
    angular_momentum: ca.SX
    total_mass: ca.SX
    elastic: ca.SX
    dissipation: ca.SX


def derive(bodies: Sequence[Body], q: ca.SX, v: ca.SX, gravity: ca.SX, forces: Sequence[Force] = ()) -> Mechanics:
    """Derive the mechanics of `bodies` by projecting Newton's and Euler's laws, body by body (Kane's method).

    Parameters
    ----------
    bodies : sequence of PointMass or RigidLink
    q, v : SX, shape (n_q, 1)
        Coordinates and their rates.
    gravity : SX, shape (2, 1)
        Gravitational acceleration in the slope-fixed frame [m/s^2].
    forces : sequence of Spring, Damper, Potential or RotorInertia
    """
    kinetic, potential, total, angular = ca.SX(0), ca.SX(0), ca.SX(0), ca.SX(0)
    momentum, mass_matrix = ca.SX.zeros(2), ca.SX.zeros(q.numel(), q.numel())
    bias = ca.SX.zeros(q.numel())
    for body in bodies:
        jacobian = ca.jacobian(body.position, q)
        velocity = jacobian @ v
        kinetic += body.mass * ca.dot(velocity, velocity) / 2
        mass_matrix += body.mass * jacobian.T @ jacobian
        bias += jacobian.T @ (body.mass * (ca.jtimes(velocity, q, v) - gravity))  # J^T m (dJ/dt v - g)
        potential -= body.mass * ca.dot(gravity, body.position)
        momentum += body.mass * velocity
        # Angles are clockwise from the vertical, and so is the moment: r_y p_x - r_x p_y.
        angular += body.mass * (body.position[1] * velocity[0] - body.position[0] * velocity[1])
        total += body.mass
        if isinstance(body, RigidLink):
            turning = ca.jacobian(body.angle, q)
            kinetic += body.inertia * (turning @ v) ** 2 / 2
            mass_matrix += body.inertia * turning.T @ turning
            bias += turning.T @ (body.inertia * ca.jtimes(turning @ v, q, v))
            angular += body.inertia * (turning @ v)
    elastic, dissipation = ca.SX(0), ca.SX(0)
    for force in forces:
        if isinstance(force, Spring | Potential):
            elastic += force.energy
            continue
        along = ca.jacobian(force.coordinate, q)
        rate = along @ v
        if isinstance(force, RotorInertia):
            kinetic += force.reflected * rate**2 / 2
            mass_matrix += force.reflected * along.T @ along
            bias += along.T @ (force.reflected * ca.jtimes(rate, q, v))
        else:
            dissipation += force.damping * rate**2
            bias += along.T @ (force.damping * rate)
    if forces:
        bias += ca.gradient(elastic, q)
        potential += elastic
    mass_matrix = ca.simplify(mass_matrix)
    return Mechanics(mass_matrix, bias, kinetic, potential, momentum, angular, total, elastic, dissipation)
