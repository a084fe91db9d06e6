"""Comparison of a robot with the robot of a gait, by physics and not by name."""

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_model_record import describe_contact_model, is_described_by
from gaitopt.model.physics import AGREEMENT, FLOOR, AnyRobot, find_differences, physics_of
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.motion.stored_robot import StoredRobot

LISTED = 3
"""Differences that a message lists."""


def require_same_physics(gait_robot: AnyRobot | StoredRobot, motion: Motion | PlanarMotion, robot: AnyRobot) -> None:
    """Raise InputError, which states what differs, unless a robot has the physics of the robot of a gait.

    Parameters
    ----------
    gait_robot : Robot, PlanarRobot or StoredRobot
        The robot of the gait.
    motion : Motion or PlanarMotion
        The planned step; of a robot that is only named, its energies and its touchdown must be those of `robot`.
    robot : Robot or PlanarRobot

    Examples
    --------
    >>> from gaitopt import compass_biped, load, rimless_wheel
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> require_same_physics(compass_biped(), gait.motion, compass_biped())
    >>> require_same_physics(compass_biped(), gait.motion, rimless_wheel())
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: The robot 'rimless_wheel' is not the robot 'compass_biped' of the gait. It differs in: angles and actuators (theta instead of th1, th2, ankle, hip). Use the robot with which the gait was computed, or solve the problem again with this one.
    """  # noqa: E501
    if gait_robot is robot:
        return
    _require_names(robot, motion, gait_robot.name)
    if isinstance(gait_robot, StoredRobot) and gait_robot.record is None:
        if isinstance(motion, Motion) and isinstance(robot, Robot):
            require_motion_of(robot, motion, gait_robot.name)
        return
    if gait_robot.record is not None and gait_robot.record.digest == robot.record.digest:
        return
    physics = gait_robot.physics if isinstance(gait_robot, StoredRobot) else physics_of(gait_robot)
    if physics is None:
        raise TypeError("a stored robot has a record without physics")
    compare = _other_contacts if isinstance(robot, PlanarRobot) else _other_contact_model
    _refuse(robot, gait_robot.name, (*find_differences(physics, robot), *compare(gait_robot, robot)))


def require_motion_of(robot: Robot, motion: Motion, name: str) -> None:
    """Raise InputError unless mass, energies and touchdowns of a motion are those of a robot.

    Parameters
    ----------
    robot : Robot
    motion : Motion
    name : str
        Name of the robot in the gait.
    """
    _require_names(robot, motion, name)
    p = robot.vector(motion.parameters)
    compared: list[tuple[str, Array, Array]] = [
        ("total mass", np.array([motion.total_mass]), np.array([float(robot.mass(p))]))
    ]
    for segment in motion.segments:
        for k in (0, segment.time.size // 2, -1):
            energies = [float(energy) for energy in robot.energy(segment.q[:, k], segment.v[:, k], p)]
            compared.append(("kinetic energy", segment.kinetic[[k]], np.array(energies[:1])))
            compared.append(("potential energy", segment.potential[[k]], np.array(energies[1:])))
    for jump in motion.jumps:
        after = [np.asarray(part, dtype=float).ravel() for part in robot.swap(jump.q, jump.v_plus, p)]
        compared.append(("leg exchange", np.concatenate([jump.q_next, jump.v_next]), np.concatenate(after)))
    differing = [label for label, expected, actual in compared if not _agree(expected, actual)]
    _refuse(robot, name, tuple(dict.fromkeys(differing)))


def _require_names(robot: AnyRobot, motion: Motion | PlanarMotion, name: str) -> None:
    """Raise InputError unless the coordinates and actuators of a robot are those of a motion, which laws rely on."""
    actual, expected = (_coordinates_of(one) for one in (robot, motion))
    if (actual, robot.actuators) != (expected, motion.actuators):
        kind = "coordinates" if isinstance(motion, PlanarMotion) else "angles"
        names = f"{', '.join((*actual, *robot.actuators))} instead of {', '.join((*expected, *motion.actuators))}"
        _refuse(robot, name, (f"{kind} and actuators ({names})",))


def _coordinates_of(source: AnyRobot | Motion | PlanarMotion) -> tuple[str, ...]:
    return source.coordinates if isinstance(source, PlanarRobot | PlanarMotion) else source.angles


def _agree(expected: Array, actual: Array) -> bool:
    """Return whether numbers agree; nan, as in a failed optimisation, is not compared."""
    size = max(float(np.max(np.abs(expected))), FLOOR)
    return bool(np.all((np.abs(expected - actual) <= AGREEMENT * size) | ~np.isfinite(expected)))


def _other_contacts(gait_robot: AnyRobot | StoredRobot, robot: AnyRobot) -> tuple[str, ...]:
    """Return which of contacts, leg exchange and switched springs differ."""
    if gait_robot.record is None:
        raise ValueError("a stored robot with several contacts has a record")
    stored, present = gait_robot.record.content(), robot.record.content()
    compared = {"contacts": "contacts", "mirror": "leg exchange", "switches": "switched springs"}
    return tuple(label for key, label in compared.items() if stored.get(key) != present[key])


def _other_contact_model(gait_robot: AnyRobot | StoredRobot, robot: AnyRobot) -> tuple[str, ...]:
    if not isinstance(robot, Robot):
        return ()
    if isinstance(gait_robot, Robot):
        described = describe_contact_model(gait_robot.contact_model)
    else:
        if gait_robot.record is None:
            raise ValueError("a stored robot without its record has no contact model")
        described = gait_robot.record.content()["contact_model"]
    return () if is_described_by(robot.contact_model, described) else ("impact law or contact transitions",)


def _refuse(robot: AnyRobot, name: str, differences: tuple[str, ...]) -> None:
    """Raise InputError if there are differences."""
    if not differences:
        return
    more = f" and {len(differences) - LISTED} more" if len(differences) > LISTED else ""
    raise InputError(
        f"The robot {robot.name!r} is not the robot {name!r} of the gait. It differs in: "
        f"{', '.join(differences[:LISTED])}{more}. Use the robot with which the gait was computed, or solve the "
        "problem again with this one."
    )
