"""Start of a walk of a robot with several contacts: the state of a gait with some coordinates and rates changed."""

from collections.abc import Mapping

import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.stability.planar_gaits.planar_section import PlanarSection

ACCURACY = 1e-9
"""Largest gap and largest speed of the closed contacts of a start [m, m/s]."""


def check_state_changes(robot: PlanarRobot, changes: Mapping[str, float]) -> None:
    """Raise InputError unless names are those of coordinates or rates of a robot, and values are finite."""
    for name, value in changes.items():
        if name not in robot.state_names:
            raise InputError(
                f"Robot {robot.name!r} has no coordinate or rate {name!r}. {suggest(name, robot.state_names)}"
            )
        if not np.isfinite(value):
            raise InputError(f"The start must have finite values, got {name} = {value:g}.")


def change_state(section: PlanarSection, y: Array, changes: Mapping[str, float]) -> Array | None:
    """Return the state on the section with some coordinates and rates changed, or None if none exists nearby.

    The others change as little as possible from their values in `y`, such that the contacts of the section stay closed:
    coordinates for the gaps, and rates for the speeds of the contacts.

    Parameters
    ----------
    section : PlanarSection
    y : (2 n_q,) array
        A state on the section.
    changes : mapping of str to float
        New values by the names of coordinates and rates.
    """
    places = [section.robot.state_names.index(name) for name in changes]
    y = np.array(y, dtype=float)
    y[places] = [*changes.values()]
    y = section.place(y, places)
    return y if np.all(np.isfinite(y)) and np.max(np.abs(section.violation(y)), initial=0.0) < ACCURACY else None
