"""Poses at touchdown: how far the robot can step, and how it stands with a given step."""

import functools
import itertools
from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array


def longest_reach(robot: Robot, values: Mapping[str, float], angle_limit: float) -> float:
    """Return the largest forward distance between the feet [m] with angles within `angle_limit` [rad]."""
    return _reach(robot, tuple(robot.vector(values)), min(angle_limit, np.pi / 2))


@functools.lru_cache(maxsize=256)
def _reach(robot: Robot, p: tuple[float, ...], angle_limit: float) -> float:
    # The distance is a sum of sines of the angles: extreme at the box's corners when the box is within 90 deg.
    corners = itertools.product((-angle_limit, angle_limit), repeat=len(robot.angles))
    zero = np.zeros(robot.n_q)
    return max(float(robot.landing(np.array([0, 0, *corner]), zero, p)[0][0]) for corner in corners)


def touchdown_pose(robot: Robot, values: Mapping[str, float], step: float) -> Array:
    """Return the angles at touchdown with the feet `step` apart, shape (n_angles,) [rad].

    Raises
    ------
    InputError
        If there is no such pose.
    """
    found = _pose(robot, tuple(robot.vector(values)), step)
    if found is None:
        raise InputError(f"Robot {robot.name!r} has no touchdown pose with a step of {step:g} m.")
    return np.array(found)


@functools.lru_cache(maxsize=256)
def _pose(robot: Robot, p: tuple[float, ...], step: float) -> tuple[float, ...] | None:
    n = len(robot.angles)
    each = np.vstack([np.zeros((2, n)), np.eye(n)])  # rates of which only one is not zero give derivatives

    def miss(angles: Array) -> tuple[Array, Array]:
        q = np.concatenate([[0.0, 0.0], angles])
        position, _, jacobian = (np.asarray(part) for part in robot.landing(q, each[:, 0], p))
        guard, rate, _ = (np.asarray(part) for part in robot.touchdown(np.tile(q[:, None], n), each, _columns(p, n)))
        value = np.array([position[0, 0] - step, position[1, 0], guard[0, 0]])
        return value, np.vstack([jacobian[:, 2:], rate])

    found = least_squares(
        lambda angles: miss(angles)[0],
        np.full(n, 0.1),
        jac=lambda angles: miss(angles)[1],
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    return None if np.max(np.abs(found.fun)) > 1e-6 else tuple(found.x)


def _columns(p: tuple[float, ...], count: int) -> Array:
    return np.tile(np.array(p)[:, None], count)
