"""Check of the type of a robot: one foot on the ground, or several contacts."""

from typing import TYPE_CHECKING

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.parameters import check_type

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot


def check_robot_type(robot: object, kind: "type[Robot] | type[PlanarRobot]", example: str, alternative: str) -> None:
    """Raise InputError unless a robot has a type.

    Parameters
    ----------
    robot : object
    kind : type
        Robot or PlanarRobot.
    example : str
    alternative : str
        Name of the problem or function that accepts a robot of the other type.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> check_robot_type(monopod(), Robot, "a Robot such as compass_biped()", "PlanarProblem")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: robot must be a Robot such as compass_biped(); PlanarRobot 'monopod' is for ...
    """
    if isinstance(robot, kind):
        return
    from gaitopt.model.planar.planar_robot import PlanarRobot  # which most problems do not need

    if isinstance(robot, Robot | PlanarRobot):
        raise InputError(f"robot must be {example}; {type(robot).__name__} {robot.name!r} is for {alternative}.")
    check_type("robot", robot, kind, example)
