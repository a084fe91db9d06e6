"""The touchdown condition seen from the step that follows: which angle it fixes, both feet on the ground."""

import functools

import casadi as ca
import numpy as np

from gaitopt.model.robot import Robot

NONE = 1e-12
"""Entries of an inverted relabelling up to this size are rounding."""


@functools.lru_cache(maxsize=32)
def dependent_coordinate(robot: Robot) -> int:
    """Return which angle the touchdown condition fixes after the swap: the number of the last one it depends on.

    That of a torso, for instance, is free, wherever it stands among the angles.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> dependent_coordinate(compass_biped())
    1
    """
    counts = np.array(robot.touchdown.jac_sparsity(0, 0))[0, 2:] != 0
    matrix, _ = _relabelling(robot, ca.SX.sym("p", len(robot.parameters)))
    came_from = np.abs(np.array(ca.inv(matrix))) > NONE
    return int(np.flatnonzero(counts @ came_from)[-1])


def touching(robot: Robot, following: ca.SX, p: ca.SX) -> ca.SX:
    """Return the touchdown guard as a function of the angles after the swap."""
    matrix, offset = _relabelling(robot, p)
    old = ca.solve(matrix, following - offset)
    return robot.touchdown(ca.vertcat(0, 0, old), ca.SX.zeros(robot.n_q), p)[0]


def _relabelling(robot: Robot, p: ca.SX) -> tuple[ca.DM, ca.SX]:
    """Return matrix and offset of the angles after the swap, which are linear in those before."""
    before = ca.SX.sym("before", len(robot.angles))
    swapped = robot.swap(ca.vertcat(0, 0, before), ca.SX.zeros(robot.n_q), p)[0][2:]
    return ca.DM(ca.jacobian(swapped, before)), ca.substitute(swapped, before, ca.SX.zeros(before.numel()))
