"""Which law a command walks under."""

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.control.law import Law, feedforward
from gaitopt.control.phase_variable import by_stance_angle
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait

if TYPE_CHECKING:
    from gaitopt.tuning.controller_family import ControllerFamily

OPEN_LOOP = "feedforward"
RESERVE = 1.2
"""Torque limit of a law relative to the one the gait was planned with."""

LawName = Annotated[str, typer.Option("--law", help="pd, computed-torque, lqr or step-to-step.")]
TorqueLimit = Annotated[
    float | None,
    typer.Option("--torque-limit", help="Of each actuator under feedback [N m]; 1.2 times the plan's by default."),
]
GainValues = Annotated[
    list[str] | None, typer.Option("--gain", metavar="NAME=VALUE", help="A gain; the others take their start values.")
]
StanceAngle = Annotated[
    bool, typer.Option("--stance-angle", help="The law goes by the stance angle, not by the time since touchdown.")
]


def feedback_named(
    name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Callable[[Gait, Robot], Law] | None:
    """Return what makes the law of a saved gait, or None where nothing was asked for but its torques, played back."""
    if name == OPEN_LOOP and not gains and not stance_angle:
        return None
    return functools.partial(law_for, name=name, gains=gains, torque_limit=torque_limit, stance_angle=stance_angle)


def law_for(
    gait: Gait, robot: Robot, name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Law:
    """Return a law for a gait by name, its gains at their starts but for those given as NAME=VALUE."""
    if name == OPEN_LOOP:
        if gains:
            raise InputError("The torques of a gait, played back, have no gains; name a feedback law with --law.")
        played = feedforward(robot, gait.motion)
        return by_stance_angle(robot, gait.motion, played) if stance_angle else played
    design = design_for(gait, robot, name, torque_limit, stance_angle)
    values = {each.name: each.start for each in design.gains}
    for gain, value in read_pairs(gains, "--gain").items():
        if gain not in values:
            raise InputError(f"The law {name!r} has no gain {gain!r}. {suggest(gain, values)}")
        values[gain] = value
    return design.law(values)


def design_for(
    gait: Gait, robot: Robot, name: str, torque_limit: float | None, stance_angle: bool
) -> "ControllerFamily":
    """Return the design of a law for a gait by name."""
    from gaitopt.tuning.controller_family import controller_family_named

    design = controller_family_named(name, robot, gait.motion, torque_limit=limit_for(gait, torque_limit))
    return design.by_stance_angle(robot, gait.motion) if stance_angle else design


def limit_for(gait: Gait, given: float | None) -> float | dict[str, float]:
    """Return the torque limit of a law: the one given, or for each actuator somewhat more than the plan's."""
    if given is not None:
        if not given > 0:
            raise InputError(f"--torque-limit must be positive, got {given:g}.")
        return given
    planned = gait.problem.get("torque_limit", math.inf)
    by_name = planned if isinstance(planned, dict) else dict.fromkeys(gait.motion.actuators, planned)
    for name, limit in by_name.items():
        if not float(limit) > 0:
            raise InputError(
                f"The gait is planned without torque at the {name}; say with --torque-limit what feedback may use "
                "there, or plan it for a robot without that actuator."
            )
    return {name: RESERVE * float(limit) for name, limit in by_name.items()}


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
