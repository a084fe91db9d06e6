"""Poses at touchdown: how far the robot can step, and how it stands with a given step."""

import functools
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array


def find_longest_reach(robot: Robot, values: Mapping[str, float], limits: Sequence[tuple[float, float]]) -> float:
    """Return the largest forward distance between the feet [m] with angles within their bounds [rad]."""
    return _reach(robot, tuple(robot.vector(values)), tuple(limits))


@functools.lru_cache(maxsize=256)
def _reach(robot: Robot, p: tuple[float, ...], limits: tuple[tuple[float, float], ...]) -> float:
    # The distance is a sum of sines of the angles: extreme at the box's corners when the box is within 90 deg.
    corners = itertools.product(*np.clip(limits, -np.pi / 2, np.pi / 2))
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
    still, units = np.zeros(robot.n_q), np.eye(robot.n_q)[2:]

    def at(angles: Array) -> Array:
        return np.concatenate([[0.0, 0.0], angles])

    def gap(angles: Array) -> Array:
        q = at(angles)
        x, y = robot.landing(q, still, p)[0].elements()
        return np.array([x - step, y, float(robot.touchdown(q, still, p)[0])])

    def slopes(angles: Array) -> Array:
        q = at(angles)
        guard = [float(robot.touchdown(q, unit, p)[1]) for unit in units]  # its rate for each unit of an angle's rate
        return np.vstack([robot.landing(q, still, p)[2].full()[:, 2:], guard])

    found = least_squares(gap, np.full(len(units), 0.1), slopes, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return None if np.max(np.abs(found.fun)) > 1e-6 else tuple(found.x)
