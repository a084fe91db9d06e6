"""The robots that come with gaitopt, by name."""

from collections.abc import Callable

from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.model.robots.compass import compass_biped
from gaitopt.model.robots.rimless import rimless_wheel

CATALOGUE: dict[str, Callable[[], Robot]] = {"compass_biped": compass_biped, "rimless_wheel": rimless_wheel}


def robot_named(name: str, given: Robot | None = None) -> Robot:
    """Return the robot a gait names: the one given, or else that of the catalogue.

    Raises
    ------
    InputError
        If the robot given has another name, or there is no such robot; the message then names the nearest.

    Examples
    --------
    >>> robot_named("compass_biped").n_q
    4
    """
    if given is not None:
        if given.name != name:
            raise InputError(f"The gait belongs to robot {name!r}, not to {given.name!r}.")
        return given
    if name not in CATALOGUE:
        raise InputError(
            f"There is no robot {name!r} in the catalogue. {suggest(name, CATALOGUE)} A robot of your own is passed as "
            f"robot=..., or on the command line as --problem SCRIPT.py."
        )
    return CATALOGUE[name]()
