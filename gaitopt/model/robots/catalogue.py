"""The built-in robots by name."""

from collections.abc import Callable

from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.model.robots.compass import compass_biped
from gaitopt.model.robots.rimless import rimless_wheel

CATALOGUE: dict[str, Callable[[], Robot]] = {"compass_biped": compass_biped, "rimless_wheel": rimless_wheel}


def robot_named(name: str, custom: Robot | None = None) -> Robot:
    """Return the robot of a gait by its name: a custom robot, or otherwise that of the catalogue.

    Raises
    ------
    InputError
        If the custom robot has another name, or the name is unknown; the message then contains the nearest one.

    Examples
    --------
    >>> robot_named("compass_biped").n_q
    4
    """
    if custom is not None:
        if custom.name != name:
            raise InputError(f"The gait belongs to robot {name!r}, not to {custom.name!r}.")
        return custom
    if name not in CATALOGUE:
        raise InputError(
            f"There is no robot {name!r} in the catalogue. {suggest(name, CATALOGUE)} A custom robot is passed as "
            f"robot=..., or on the command line as --problem SCRIPT.py."
        )
    return CATALOGUE[name]()
