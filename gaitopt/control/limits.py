"""Torque limits of a law."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter


def torque_limits(robot: Robot, given: float | Mapping[str, float]) -> Array:
    """Return the limit of each actuator [N m], shape (n_u,); empty where none is limited.

    Raises
    ------
    InputError
        If a limit is not positive or names no actuator.
    """
    by_name = dict(given) if isinstance(given, Mapping) else dict.fromkeys(robot.actuators, given)
    for name in by_name:
        if name not in robot.actuators:
            raise InputError(f"torque_limit: there is no actuator {name!r}. {suggest(name, robot.actuators)}")
    values = [
        Parameter(f"torque_limit of {name}", np.inf, "N m", "", lower=0.0, lower_open=True, infinite=True).check(
            by_name.get(name, np.inf)
        )
        for name in robot.actuators
    ]
    return np.array(values) if np.any(np.isfinite(values)) else np.zeros(0)


def limited(torque: ca.SX, limits: ca.SX) -> ca.SX:
    """Return a torque within its limits, shape (n_u, 1); none where `limits` is empty."""
    return ca.fmin(ca.fmax(torque, -limits), limits) if limits.numel() else torque
