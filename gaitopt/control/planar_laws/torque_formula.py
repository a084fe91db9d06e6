"""Torques of a phase as Functions (t, q, v, latched, data) -> u that an engine can compile.

Each is built once per torque or part of a law, so that an engine compiles it once.
"""

import functools

import casadi as ca

from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.mirror import Mirror


@functools.lru_cache(maxsize=128)
@one_at_a_time
def function_formula(torque: ca.Function) -> ca.Function | None:
    """Return the formula of a torque (t, q, v) -> u without latched values and data; None if it has no expression.

    Examples
    --------
    >>> t, q, v = ca.SX.sym("t"), ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    >>> function_formula(ca.Function("torque", [t, q, v], [t * q[0]]))(2, [3, 4], [0, 0], [], [])
    DM(6)
    """
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", torque.size1_in(1)), ca.SX.sym("v", torque.size1_in(2))
    try:
        value = torque(t, q, v)
    except (RuntimeError, NotImplementedError):  # for example an interpolant
        return None
    return ca.Function("formula", [t, q, v, ca.SX.sym("latched", 0), ca.SX.sym("data", 0)], [ca.densify(value)])


@functools.lru_cache(maxsize=128)
@one_at_a_time
def law_formula(torque: ca.Function, mirror: Mirror | None) -> ca.Function | None:
    """Return the formula of a law's part; its data are the time at which the clock is zero, and a column of its table.

    Parameters
    ----------
    torque : Function
        (clock, q, v, latched, slide, column) -> torque, ...
    mirror : Mirror or None
        The exchange of the legs, while they are exchanged.

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> law_formula(passive(monopod()).torque, None).size_in(4)
    (1, 1)
    """
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", torque.size1_in(1)), ca.SX.sym("v", torque.size1_in(2))
    latched, data = ca.SX.sym("latched", torque.size1_in(3)), ca.SX.sym("data", 1 + torque.size1_in(5))
    coordinates = ca.DM.eye(q.numel()) if mirror is None else ca.DM(mirror.coordinates)
    try:
        value = torque(t - data[0], coordinates @ q, coordinates @ v, latched, 0, data[1:])[0]
    except (RuntimeError, NotImplementedError):
        return None
    if mirror is not None:
        value = ca.DM(mirror.actuators).T @ value
    return ca.Function("formula", [t, q, v, latched, data], [ca.densify(value)])
