"""Choice of the law of a robust plan: a name, a law, or a function that makes the law of a gait."""

from collections.abc import Callable

from gaitopt.control.law import Law, feedforward
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Motion
from gaitopt.tuning.controller_family import ControllerFamily, TorqueLimit, controller_family_named
from gaitopt.tuning.custom_family import check_law_function, make_custom_family

OPEN_LOOP = "feedforward"
"""Name of the law that replays the planned torques."""

LawFunction = Callable[[Robot, Motion, TorqueLimit], Law | ControllerFamily]
"""Function (robot, motion, torque_limit) -> law or family of laws of a gait."""

LawChoice = str | Law | LawFunction
"""A name, a law, or a function of a gait."""


def check_law_choice(law: object) -> None:
    """Raise InputError unless a law is a name, a Law or a function.

    Examples
    --------
    >>> check_law_choice(3)
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: law must be a name such as 'computed_torque' or 'feedforward', a Law, or a function ...
    """
    if not (isinstance(law, str | Law) or callable(law)):
        raise InputError(
            "law must be a name such as 'computed_torque' or 'feedforward', a Law, or a function (robot, motion, "
            f"torque_limit) that returns a Law or a ControllerFamily, got {law!r}."
        )


def make_family(law: LawChoice, gait: Gait, limit: TorqueLimit) -> ControllerFamily:
    """Return the family of laws for a gait; it has no gains if the law has none to tune.

    Parameters
    ----------
    law : str, Law or callable
    gait : Gait
    limit : float or mapping of actuator to float [N m]
        Limit of the torques; the open loop has none, and a law that states its limits keeps them.

    Raises
    ------
    InputError
        If the name is unknown, or the function returns something else.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> make_family("feedforward", gait, 8.0).gains
    ()
    """
    robot, motion = gait.robot, gait.motion
    if isinstance(law, str) and law == OPEN_LOOP:
        return ControllerFamily(OPEN_LOOP, (), lambda _: feedforward(robot, motion))
    if isinstance(law, str):
        return controller_family_named(law, robot, motion, torque_limit=limit)
    if isinstance(law, Law):
        return make_custom_family(law, law.name, robot, limit)
    name = getattr(law, "__name__", "law")
    check_law_function(law, name)
    return make_custom_family(law(robot, motion, limit), name, robot, limit)
