"""Custom laws of scripts, named SCRIPT.py:FUNCTION on the command line."""

import ast
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.script import load_script, run_in_script
from gaitopt.cli.settings import read_numbers
from gaitopt.errors import InputError, ScriptError, suggest

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot
    from gaitopt.motion.motion import Motion
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.tuning.controller_family import ControllerFamily

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
    from gaitopt.tuning.custom_family import check_law_function, make_custom_family

    law, name = load_script(script, function), f"{function} of {script}"
    check_law_function(law, name)
    made = _call(script, law, robot, motion, limit)
    return replace(make_custom_family(made, name, robot, limit), name=f"{script}:{function}")


def require_function_name(law: str) -> None:
    """Raise InputError if a law is a script without the name of a function; the error lists the script's functions."""
    if Path(law).suffix != ".py":
        return
    try:
        body = ast.parse(Path(law).read_bytes()).body
    except (OSError, SyntaxError, ValueError):  # the error of the form is stated first
        body = []
    names = [each.name for each in body if isinstance(each, ast.FunctionDef) and not each.name.startswith("_")]
    listed = f" Functions of {law}: {', '.join(names)}." if names else ""
    raise InputError(f"A custom law has the form SCRIPT.py:FUNCTION, got {law!r} without a function.{listed}")


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


def _call(script: Path, law: Any, *arguments: Any) -> Any:
    """Return what the function of a law returns; an error states the accepted form if its arguments are others."""
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.tuning.custom_family import SEVERAL_CONTACTS, describe_form

    try:
        return run_in_script(script, law, *arguments)
    except (InputError, ScriptError) as error:
        of_planar = isinstance(arguments[0], PlanarRobot) and any(name in str(error) for name in PLANAR_ARGUMENTS)
        advice = SEVERAL_CONTACTS if of_planar else describe_form(law) if isinstance(error, ScriptError) else ""
        if not advice:
            raise
        kind = ScriptError if isinstance(error, ScriptError) else InputError
        raise kind(f"{str(error).rstrip('.')}. {advice}") from error
