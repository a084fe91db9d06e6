"""Dependent coordinate on the section after touchdown: the angle determined by the touchdown condition."""

import functools

import casadi as ca
import numpy as np

from gaitopt.model.robot import Robot

NONE = 1e-12
"""Entries of an inverted relabelling up to this size are rounding."""


@functools.lru_cache(maxsize=32)
def dependent_coordinate(robot: Robot) -> int:
    """Return the number of the angle that the touchdown condition determines after the leg exchange.

    It is the last angle on which the condition depends; the angle of a torso, for instance, is free.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> dependent_coordinate(compass_biped())
    1
    """
    counts = np.array(robot.touchdown.jac_sparsity(0, 0))[0, 2:] != 0
    matrix, _ = _relabel_map(robot, ca.SX.sym("p", len(robot.parameters)))
    sources = np.abs(np.array(ca.inv(matrix))) > NONE
    return int(np.flatnonzero(counts @ sources)[-1])


@functools.lru_cache(maxsize=32)
def dependent_angle(robot: Robot) -> ca.Function:
    """Return (other angles, p) -> the angle that the touchdown condition determines after the leg exchange.

    The exchange of the angles is linear, so one Newton step suffices for a linear touchdown guard; others take a few.
    """
    others, p = ca.SX.sym("others", len(robot.angles) - 1), ca.SX.sym("p", len(robot.parameters))
    angle, place = ca.SX.sym("angle"), dependent_coordinate(robot)
    angles = ca.vertsplit(others)
    angles.insert(place, angle)
    condition = guard_after_swap(robot, ca.vertcat(*angles), p)
    newton = ca.Function("newton", [angle, others, p], [angle - condition / ca.jacobian(condition, angle)])
    start = others[max(place - 1, 0)] if others.numel() else ca.SX(0)
    value = ca.MX.sym("others", others.numel()), ca.MX.sym("p", p.numel())
    guess = ca.Function("start", [others], [start])(value[0])
    for _ in range(8):
        guess = newton(guess, *value)
    return ca.Function("dependent_angle", list(value), [guess]).expand()


def guard_after_swap(robot: Robot, following: ca.SX, p: ca.SX) -> ca.SX:
    """Return the touchdown guard as a function of the angles after the leg exchange."""
    old = angles_before_swap(robot, following, p)
    return robot.touchdown(ca.vertcat(0, 0, old), ca.SX.zeros(robot.n_q), p)[0]


def angles_before_swap(robot: Robot, following: ca.SX, p: ca.SX) -> ca.SX:
    """Return the angles before the leg exchange as a function of those after it."""
    matrix, offset = _relabel_map(robot, p)
    return ca.solve(matrix, following - offset)


@functools.lru_cache(maxsize=32)
def undo_exchange(robot: Robot) -> ca.Function:
    """Return the Function (angles after the leg exchange, p) -> angles before it."""
    angles, p = ca.SX.sym("angles", len(robot.angles)), ca.SX.sym("p", len(robot.parameters))
    return ca.Function("undo_exchange", [angles, p], [ca.densify(angles_before_swap(robot, angles, p))])


def _relabel_map(robot: Robot, p: ca.SX) -> tuple[ca.DM, ca.SX]:
    """Return matrix and offset of the linear map from the angles before the swap to those after."""
    before = ca.SX.sym("before", len(robot.angles))
    swapped = robot.swap(ca.vertcat(0, 0, before), ca.SX.zeros(robot.n_q), p)[0][2:]
    return ca.DM(ca.jacobian(swapped, before)), ca.substitute(swapped, before, ca.SX.zeros(before.numel()))
