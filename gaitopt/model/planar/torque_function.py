"""Torques of a planar robot as Functions (t, q, v) -> u, and their derivatives."""

import functools

import casadi as ca

from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot


@functools.lru_cache(maxsize=64)
def passive_torque(robot: PlanarRobot) -> ca.Function:
    """Return the torque zero.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> passive_torque(monopod())(0, [0] * 5, [0] * 5)
    DM([0, 0])
    """
    symbols = [ca.SX.sym("t"), ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)]
    return ca.Function("torque", symbols, [ca.SX.zeros(robot.n_u)])


@functools.lru_cache(maxsize=64)
def torque_slope(torque: ca.Function) -> ca.Function | None:
    """Return (t, q, v) -> derivatives of a torque with respect to t, q and v as dense matrices; None if it is constant.

    Examples
    --------
    >>> t, q, v = ca.SX.sym("t"), ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    >>> torque_slope(ca.Function("torque", [t, q, v], [t * q[0]]))(2, [3, 4], [0, 0])
    (DM(3), DM([[2, 0]]), DM([[0, 0]]))
    """
    symbols = [ca.MX.sym(name, torque.size1_in(i)) for i, name in enumerate("tqv")]
    value = torque(*symbols)
    slopes = [ca.jacobian(value, symbol) for symbol in symbols]
    if not any(slope.nnz() for slope in slopes):
        return None
    return ca.Function("torque_slope", symbols, [ca.densify(slope) for slope in slopes])


def check_torque(robot: PlanarRobot, torque: ca.Function) -> None:
    """Raise InputError unless a torque is a Function (t, q, v) -> u of a robot."""
    sizes = [torque.size1_in(i) for i in range(torque.n_in())]
    if sizes != [1, robot.n_q, robot.n_q] or torque.size1_out(0) != robot.n_u:
        raise InputError(
            f"The torque of {robot.name!r} must be a Function (t, q, v) -> u with {robot.n_q} coordinates and "
            f"{robot.n_u} actuators, got {torque}."
        )
