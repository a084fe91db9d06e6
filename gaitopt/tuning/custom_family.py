"""Controller families of custom laws: functions (robot, motion, torque_limit), also of a script."""

import inspect
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError, describe_missing_file, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count
from gaitopt.tuning.controller_family import ControllerFamily, TorqueLimit

FORM = (
    "accepted are a function (state, plan, gain=value, ...) with the decorator gaitopt.control.define_law, or a "
    "function (robot, motion, torque_limit) that returns a law"
)
"""Forms of a custom law, for messages."""

SEVERAL_CONTACTS = (
    "For a robot with several contacts, the function receives the PlanarGait in place of the motion and returns a "
    "PlanarLaw; the decorator gaitopt.control.define_law makes laws of both kinds of robots."
)
"""Advice for a law of a robot with one foot on the ground that is used for a robot with several contacts."""


def check_law_function(function: Callable[..., Any], name: str) -> None:
    """Raise InputError unless a function accepts robot, motion and torque limit.

    Examples
    --------
    >>> check_law_function(lambda robot, motion: None, "my_law")
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: my_law is not the function of a law: its arguments are (robot, motion); accepted are ...
    """
    if isinstance(function, type):
        raise InputError(f"{name} is a class; {FORM}.")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # of a function without a known signature
        return
    try:
        signature.bind(None, None, None)
    except TypeError:
        raise InputError(f"{name} is not the function of a law: its arguments are {signature}; {FORM}.") from None


def describe_form(function: Callable[..., Any]) -> str:
    """Return the form of a custom law if the arguments of a function are not those of one, otherwise nothing.

    Examples
    --------
    >>> describe_form(lambda t, q, v: 0)[:43]
    'Its arguments are (t, q, v); accepted are a'
    """
    try:
        names = list(inspect.signature(function).parameters)
    except (TypeError, ValueError):
        return ""
    return "" if names[:1] == ["robot"] else f"Its arguments are ({', '.join(names)}); {FORM}."


def make_custom_family(made: object, name: str, robot: Robot | PlanarRobot, limit: TorqueLimit) -> ControllerFamily:
    """Return the family of the law or ControllerFamily that a function has returned, with torque limits.

    Parameters
    ----------
    made : Law, PlanarLaw or ControllerFamily
    name : str
        Name of the function, for messages.
    robot : Robot or PlanarRobot
    limit : float or mapping of actuator to float [N m or N]
        Limit of the torques; a law that states its limits keeps them.

    Raises
    ------
    InputError
        If the function has returned something else, or a law of another robot.
    """
    family = made
    if isinstance(made, Law | PlanarLaw):
        _check_law(name, robot, made)
        family = ControllerFamily.from_law(made)
    if not isinstance(family, ControllerFamily):
        raise InputError(
            f"{name}(robot, motion, torque_limit) must return a Law or a ControllerFamily, but returned "
            f"{type(made).__name__}; {FORM}."
        )
    return family.with_torque_limit(robot, limit)


def _check_law(name: str, robot: Robot | PlanarRobot, law: Law | PlanarLaw) -> None:
    """Raise InputError if a law is of another kind than its robot, or has other coordinates or actuators."""
    single = isinstance(law, Law)
    if single is isinstance(robot, PlanarRobot):
        kind, other = (
            ("Law", SEVERAL_CONTACTS) if single else ("PlanarLaw", "A robot with one foot on the ground needs a Law.")
        )
        raise InputError(f"{name} returns a {kind}. {other}")
    for part in [law] if isinstance(law, Law) else law.parts:
        coordinates, torques = part.control.size1_in(1), part.control.numel_out(0)
        if torques != robot.n_u:
            plural, actuators = "s" * (torques != 1), ", ".join(robot.actuators)
            raise InputError(
                f"The law of {name} returns {torques} torque{plural}, but the robot has {robot.n_u}: {actuators}."
            )
        if coordinates != robot.n_q:
            raise InputError(
                f"The law of {name} has {format_count(coordinates, 'coordinate')}, but the robot has {robot.n_q}."
            )


def load_custom_family(
    script: Path, function: str, robot: Robot | PlanarRobot, motion: Motion | PlanarGait, limit: TorqueLimit
) -> ControllerFamily:
    """Return the family of the law that a function of a script makes.

    Raises
    ------
    InputError
        If there is no such script or function, or it is not a custom law.
    """
    if not script.is_file():
        raise InputError(describe_missing_file(script))
    module, former = types.ModuleType(f"law script {script.stem}"), list(sys.path)
    module.__file__ = str(script)
    sys.modules[module.__name__] = module  # dataclasses look up their module
    sys.path.insert(0, str(script.parent.resolve()))  # a script may import its neighbours
    try:
        exec(compile(script.read_bytes(), str(script), "exec"), module.__dict__)
        law = getattr(module, function, None)
        if not callable(law):
            known = [name for name, value in vars(module).items() if inspect.isfunction(value)]
            raise InputError(f"{script} has no function {function}. {suggest(function, known)}")
        check_law_function(law, function)
        made = law(robot, motion, limit)
    finally:
        sys.path[:] = former
    return replace(make_custom_family(made, function, robot, limit), name=f"{script}:{function}")
