"""Custom laws of scripts, named SCRIPT.py:FUNCTION on the command line."""

import inspect
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.script import load_script, run_in_script
from gaitopt.cli.settings import read_numbers
from gaitopt.errors import InputError, ScriptError, suggest

if TYPE_CHECKING:
    from gaitopt.control.law import Law
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot
    from gaitopt.motion.motion import Motion
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.tuning.controller_family import ControllerFamily

FORM = (
    "accepted are a function (state, plan, gain=value, ...) with the decorator gaitopt.control.define_law, or a "
    "function (robot, motion, torque_limit) that returns a law"
)
"""Forms of a custom law in a script, for messages."""

SEVERAL_CONTACTS = (
    "For a robot with several contacts, the function receives the PlanarGait in place of the motion and returns a "
    "PlanarLaw; the decorator gaitopt.control.define_law makes laws of both kinds of robots."
)
"""Advice for a law of a robot with one foot on the ground that is used for a robot with several contacts."""

PLANAR_ARGUMENTS = ("PlanarGait", "PlanarRobot")
"""Types of the arguments for a robot with several contacts, which occur in the messages if others are expected."""


def custom_design(
    script: Path,
    function: str,
    robot: "Robot | PlanarRobot",
    motion: "Motion | PlanarGait",
    limit: float | Mapping[str, float],
) -> "ControllerFamily":
    """Return the family of laws that a function (robot, motion, torque_limit) of a script makes.

    The function may return a single law: its gains are tuned.  Laws without torque limits get those of the command.

    Raises
    ------
    InputError
        If the script has no such function, or it returns something else.
    ScriptError
        If the script raises anything else.
    """
    from gaitopt.control.law import Law
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.tuning.controller_family import ControllerFamily

    made = _call(script, function, robot, motion, limit)
    design = made
    if isinstance(made, Law | PlanarLaw):
        _check_law(f"{function} of {script}", robot, made)
        design = ControllerFamily.from_law(made)
    if not isinstance(design, ControllerFamily):
        raise InputError(
            f"{function}(robot, motion, torque_limit) of {script} must return a Law or a ControllerFamily, it returned "
            f"{type(made).__name__}; {FORM}."
        )
    return replace(design.with_torque_limit(robot, limit), name=f"{script}:{function}")


def make_family_law(family: "ControllerFamily", tuned: Mapping[str, float], gains: list[str] | None) -> Any:
    """Return the law of a family with its tuned gains, or the values with which tuning starts, and with ``NAME=VALUE``.

    Raises
    ------
    InputError
        If the law has no such gain.
    """
    values = {gain.name: tuned.get(gain.name, gain.start) for gain in family.gains}
    changes, law = read_numbers(gains, "--gain"), family.law(values)
    known = dict.fromkeys([*values, *law.gain_values])
    for gain in changes:
        if gain not in known:
            raise InputError(f"The law {family.name!r} has no gain {gain!r}. {suggest(gain, known)}")
    return family.law(values | changes) if changes else law


def _call(script: Path, function: str, *arguments: Any) -> Any:
    """Return what a function of a script returns; raise InputError if it does not accept the arguments."""
    from gaitopt.model.planar.planar_robot import PlanarRobot

    called = load_script(script, function)
    if isinstance(called, type):
        raise InputError(f"{function} of {script} is a class; {FORM}.")
    signature = inspect.signature(called)
    try:
        signature.bind(*arguments)
    except TypeError:
        raise InputError(f"{function}{signature} of {script} is not the function of a law; {FORM}.") from None
    try:
        return run_in_script(script, called, *arguments)
    except (InputError, ScriptError) as error:
        if not isinstance(arguments[0], PlanarRobot) or not any(name in str(error) for name in PLANAR_ARGUMENTS):
            raise
        kind = ScriptError if isinstance(error, ScriptError) else InputError
        raise kind(f"{str(error).rstrip('.')}. {SEVERAL_CONTACTS}") from error


def _check_law(name: str, robot: "Robot | PlanarRobot", law: "Law | PlanarLaw") -> None:
    """Raise InputError if a law is of another kind than its robot, or has other coordinates or actuators."""
    from gaitopt.control.law import Law
    from gaitopt.model.planar.planar_robot import PlanarRobot

    single = isinstance(law, Law)
    if single is isinstance(robot, PlanarRobot):
        kind, other = (
            ("Law", SEVERAL_CONTACTS) if single else ("PlanarLaw", "A robot with one foot on the ground needs a Law.")
        )
        raise InputError(f"{name} returns a {kind}. {other}")
    for part in [law] if isinstance(law, Law) else law.parts:
        counts = part.control.size1_in(1), part.control.numel_out(0)
        if counts != (robot.n_q, robot.n_u):
            raise InputError(
                f"The law of {name} has {counts[0]} coordinates and {counts[1]} torques; the robot has {robot.n_q} "
                f"coordinates and {robot.n_u} actuators ({', '.join(robot.actuators)})."
            )
