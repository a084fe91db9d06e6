"""The robot of a gait that was read from a file, restored when it is first used."""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InputError
from gaitopt.lazy import Deferred
from gaitopt.model.physics_samples import PhysicsSamples
from gaitopt.model.robot_record import RobotRecord
from gaitopt.motion.motion import Motion

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot


class StoredRobot(Deferred[Any]):
    """A robot that is restored when it is first used.

    Attributes
    ----------
    name : str
    record : RobotRecord or None
        None in files of versions 1 and 2, which only name their robot.
    physics : PhysicsSamples or None

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> gait.robot_name, gait.robot is compass_biped()
    ('compass_biped', True)
    """

    __slots__ = ("__weakref__", "name", "physics", "record")

    def __init__(
        self,
        read: Callable[[], Any],
        name: str,
        record: RobotRecord | None = None,
        physics: PhysicsSamples | None = None,
    ) -> None:
        super().__init__(read, portable=True)
        self.name, self.record, self.physics = name, record, physics

    @staticmethod
    def from_record(record: RobotRecord, physics: PhysicsSamples) -> "StoredRobot":
        """Return a robot that a file contains."""
        return StoredRobot(functools.partial(_restore, record, physics), record.name, record, physics)

    @staticmethod
    def from_name(name: str, motion: Motion) -> "StoredRobot":
        """Return the robot of a file that contains only its name: that of the catalogue, if it has this motion."""
        return StoredRobot(functools.partial(_find, name, motion), name)


def _restore(record: RobotRecord, physics: PhysicsSamples) -> "Robot | PlanarRobot":
    from gaitopt.model.planar.planar_record import is_planar
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robots.catalogue import restore_robot

    if is_planar(record):
        return PlanarRobot.from_record(record)
    return restore_robot(record, physics)


def _find(name: str, motion: Motion) -> "Robot":
    from gaitopt.model.robots.catalogue import CATALOGUE
    from gaitopt.motion.robot_check import require_motion_of

    if name not in CATALOGUE:
        raise InputError(
            "The file of this gait has an older format and contains only the name of its robot, "
            f"{name!r}, which is not in the catalogue ({', '.join(CATALOGUE)}). Specify the robot: "
            "gait.with_robot(robot), or --problem SCRIPT.py on the command line."
        )
    robot = CATALOGUE[name]()
    require_motion_of(robot, motion, name)
    return robot
