"""Torques of a planar robot as functions of time."""

import casadi as ca

from gaitopt.motion.motion import Array


def interpolate_torque(n_q: int, time: Array, torque: Array) -> ca.Function:
    """Return a torque (t, q, v) -> u that is linear between samples and continued beyond them.

    Parameters
    ----------
    n_q : int
        Number of coordinates.
    time : (K,) array [s]
        Increasing.
    torque : (n_u, K) array [N m or N]

    Examples
    --------
    >>> import numpy as np
    >>> interpolate_torque(1, np.array([0.0, 1.0]), np.array([[0.0, 3.0]]))(0.5, 0, 0)
    DM(1.5)
    """
    t = ca.SX.sym("t")
    curves = [ca.pw_lin(t, ca.DM(time), ca.DM(row)) for row in torque]
    return ca.Function("torque", [t, ca.SX.sym("q", n_q), ca.SX.sym("v", n_q)], [ca.vertcat(*curves)])
