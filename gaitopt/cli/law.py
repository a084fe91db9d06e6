"""The law of a command: a family by name, a function of a script, or a file of tuned gains."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.script import run_function
from gaitopt.control.law import Law, feedforward
from gaitopt.control.phase_variable import by_stance_angle
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Motion
from gaitopt.tuning.controller_family import DESIGNS, ControllerFamily, controller_family_named

OPEN_LOOP = "feedforward"
RESERVE = 1.2
"""Torque limit of a law relative to the one the gait was planned with."""

LawName = Annotated[
    str,
    typer.Option(
        "--law",
        metavar="NAME|FILE",
        help=f"{', '.join(DESIGNS)}; SCRIPT.py:FUNCTION for a custom law; or a file of tuned gains (tune -o).",
    ),
]
TorqueLimit = Annotated[
    float | None,
    typer.Option(
        "--torque-limit",
        help=f"Torque limit of each actuator under feedback [N m]; {RESERVE:g} times the plan's by default.",
    ),
]
GainValues = Annotated[
    list[str] | None,
    typer.Option("--gain", metavar="NAME=VALUE", help="Value of a gain; the others keep their start values."),
]
StanceAngle = Annotated[
    bool,
    typer.Option("--stance-angle", help="Use the stance angle as phase variable instead of the time since touchdown."),
]


def feedback_named(
    name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Callable[[Gait, Robot], Law] | None:
    """Return the builder of the law of a saved gait, or None if its torques are to be played back."""
    if name == OPEN_LOOP and not gains and not stance_angle:
        return None
    return functools.partial(law_for, name=name, gains=gains, torque_limit=torque_limit, stance_angle=stance_angle)


def law_for(
    gait: Gait, robot: Robot, name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Law:
    """Return a law for a gait, its gains at their start or tuned values except for those set as NAME=VALUE."""
    if name == OPEN_LOOP:
        if gains:
            raise InputError("The torques of a gait, played back, have no gains; name a feedback law with --law.")
        played = feedforward(robot, gait.motion)
        return by_stance_angle(robot, gait.motion, played) if stance_angle else played
    design, values = design_for(gait, robot, name, torque_limit, stance_angle), dict[str, float]()
    if Path(name).suffix == ".json":
        from gaitopt.tuning.tuning_file import load_tuning

        values.update(load_tuning(name).gains)
    values = {each.name: values.get(each.name, each.start) for each in design.gains}
    for gain, value in read_pairs(gains, "--gain").items():
        if gain not in values:
            raise InputError(f"The law {name!r} has no gain {gain!r}. {suggest(gain, values)}")
        values[gain] = value
    return design.law(values)


def design_for(gait: Gait, robot: Robot, name: str, torque_limit: float | None, stance_angle: bool) -> ControllerFamily:
    """Return the family of laws for a gait: by name, of a script as SCRIPT.py:FUNCTION, or of a file of tuned gains."""
    limit: float | Mapping[str, float]
    if Path(name).suffix == ".json":
        from gaitopt.tuning.tuning_file import load_tuning

        tuned = load_tuning(name)
        limit = limit_for(gait, torque_limit) if torque_limit is not None else tuned.settings.torque_limit
        name, stance_angle = tuned.design, stance_angle or tuned.settings.stance_angle
    else:
        limit = limit_for(gait, torque_limit)
    script, colon, function = name.rpartition(":")
    if colon and script.endswith(".py"):
        design = custom_design(Path(script), function, robot, gait.motion, limit)
    else:
        design = controller_family_named(name, robot, gait.motion, torque_limit=limit)
    return design.by_stance_angle(robot, gait.motion) if stance_angle else design


def custom_design(
    script: Path, function: str, robot: Robot, motion: Motion, limit: float | Mapping[str, float]
) -> ControllerFamily:
    """Return the family of laws that a function (robot, motion, torque_limit) of a script makes: a Design, or a Law.

    Raises
    ------
    InputError
        If the script has no such function, or it returns something else.
    ScriptError
        If the script raises anything else.
    """
    made = run_function(script, function, robot, motion, limit)
    design = ControllerFamily.of(made) if isinstance(made, Law) else made
    if not isinstance(design, ControllerFamily):
        raise InputError(
            f"{function}(robot, motion, torque_limit) of {script} must return a Law or a Design, it returned "
            f"{type(made).__name__}."
        )
    return replace(design, name=f"{script}:{function}", settings=replace(design.settings, torque_limit=limit))


def limit_for(gait: Gait, limit: float | None) -> float | dict[str, float]:
    """Return the torque limit of a law: the requested one, or for each actuator somewhat more than the plan's."""
    if limit is not None:
        if not limit > 0:
            raise InputError(f"--torque-limit must be positive, got {limit:g}.")
        return limit
    planned = gait.problem.get("torque_limit", math.inf)
    by_name = planned if isinstance(planned, dict) else dict.fromkeys(gait.motion.actuators, planned)
    for name, most in by_name.items():
        if not float(most) > 0:
            raise InputError(
                f"The gait is planned without torque at the {name}; set the limit of the feedback with --torque-limit, "
                "or plan the gait for a robot without that actuator."
            )
    return {name: RESERVE * float(most) for name, most in by_name.items()}


def read_pairs(settings: list[str] | None, option: str = "--state") -> dict[str, float]:
    """Return NAME=NUMBER settings as a mapping."""
    values = {}
    for text in settings or []:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"{option} needs NAME=NUMBER, got {text!r}.") from None
    return values
