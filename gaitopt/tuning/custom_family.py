"""Controller families of custom laws: functions (robot, motion, torque_limit), also of a script."""

import inspect
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gaitopt.control.law import Law
from gaitopt.errors import InputError, describe_missing_file, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Motion
from gaitopt.tuning.controller_family import ControllerFamily, TorqueLimit

FORM = "a custom law is a function (robot, motion, torque_limit) that returns a Law or a ControllerFamily"


def check_law_function(function: Callable[..., Any], name: str) -> None:
    """Raise InputError unless a function accepts robot, motion and torque limit.

    Examples
    --------
    >>> check_law_function(lambda robot, motion: None, "my_law")
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: my_law(robot, motion) does not accept three arguments: a custom law is a function ...
    """
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # of a function without a known signature
        return
    try:
        signature.bind(None, None, None)
    except TypeError:
        raise InputError(f"{name}{signature} does not accept three arguments: {FORM}.") from None


def describe_form(function: Callable[..., Any]) -> str:
    """Return the form of a custom law if the arguments of a function are not those of one, otherwise nothing.

    Examples
    --------
    >>> describe_form(lambda t, q, v: 0)[:41]
    'Its arguments are (t, q, v), but a custom'
    """
    try:
        names = list(inspect.signature(function).parameters)
    except (TypeError, ValueError):
        return ""
    return "" if names[:1] == ["robot"] else f"Its arguments are ({', '.join(names)}), but {FORM}."


def make_custom_family(made: object, name: str, robot: Robot, limit: TorqueLimit) -> ControllerFamily:
    """Return the family of the Law or ControllerFamily that a function has returned, with torque limits.

    Parameters
    ----------
    made : Law or ControllerFamily
    name : str
        Name of the function, for messages.
    robot : Robot
    limit : float or mapping of actuator to float [N m]
        Limit of the torques; a law that states its limits keeps them.

    Raises
    ------
    InputError
        If the function has returned something else.
    """
    if isinstance(made, Law) and (torques := made.control.size1_out(0)) != robot.n_u:
        plural, actuators = "s" * (torques != 1), ", ".join(robot.actuators)
        raise InputError(f"The law of {name} returns {torques} torque{plural}, the robot has {robot.n_u}: {actuators}.")
    family = ControllerFamily.from_law(made) if isinstance(made, Law) else made
    if not isinstance(family, ControllerFamily):
        raise InputError(
            f"{name}(robot, motion, torque_limit) must return a Law or a ControllerFamily, it returned "
            f"{type(made).__name__}."
        )
    return family.with_torque_limit(robot, limit)


def load_custom_family(
    script: Path, function: str, robot: Robot, motion: Motion, limit: TorqueLimit
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
