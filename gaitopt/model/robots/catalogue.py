"""The built-in robots by name."""

from collections.abc import Callable

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.model.contacts.contact_model_record import is_described_by
from gaitopt.model.physics import find_differences
from gaitopt.model.physics_samples import PhysicsSamples
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.model.robot_record import RobotRecord, describe_parameter
from gaitopt.model.robots.compass import compass_biped
from gaitopt.model.robots.rimless import rimless_wheel

CATALOGUE: dict[str, Callable[[], Robot]] = {"compass_biped": compass_biped, "rimless_wheel": rimless_wheel}
"""Robots with one foot on the ground."""


@check_arguments
def robot_named(name: str) -> Robot | PlanarRobot:
    """Return a robot of the catalogue.

    Raises
    ------
    InputError
        If the name is unknown; the message then contains the nearest one.

    Examples
    --------
    >>> robot_named("compass_biped").n_q, robot_named("monopod").n_q
    (4, 5)
    """
    if name in CATALOGUE:
        return CATALOGUE[name]()
    from gaitopt.model.robots.planar_catalogue import PLANAR_CATALOGUE

    known: dict[str, Callable[[], Robot | PlanarRobot]] = {**CATALOGUE, **PLANAR_CATALOGUE}
    if name not in known:
        raise InputError(f"There is no robot {name!r} in the catalogue. {suggest(name, known)}")
    return known[name]()


def restore_robot(record: RobotRecord, physics: PhysicsSamples) -> Robot:
    """Return the robot of a record: that of the catalogue if it is the same, otherwise the one in the record.

    Parameters
    ----------
    record : RobotRecord
    physics : PhysicsSamples
        Samples of the physics of the robot in the record.

    Raises
    ------
    ArchiveError
        If the record is damaged, or the installed CasADi cannot read it.

    Examples
    --------
    >>> from gaitopt.model.physics import physics_of
    >>> wheel = rimless_wheel()
    >>> restore_robot(wheel.record, physics_of(wheel)) is wheel
    True
    """
    if record.name in CATALOGUE and not Robot.is_restored(record):
        robot = CATALOGUE[record.name]()
        if _is_same(robot, record, physics):
            return robot.share(record)
    return Robot.from_record(record)


def _is_same(robot: Robot, record: RobotRecord, physics: PhysicsSamples) -> bool:
    """Return whether a robot has the names, parameters and physics of a record."""
    content = record.content()
    named = all(content[name] == [*getattr(robot, name)] for name in ("angles", "actuators", "points")) and content[
        "links"
    ] == [list(link) for link in robot.links]
    return (
        named
        and content["parameters"] == [describe_parameter(parameter) for parameter in robot.parameters]
        and is_described_by(robot.contact_model, content["contact_model"])
        and not find_differences(physics, robot)
    )
