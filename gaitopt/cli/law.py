"""The control law of a command, from its options."""

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from gaitopt.cli.settings import read_numbers
from gaitopt.control.law import Law, feedforward
from gaitopt.control.phase_variable import by_stance_angle
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait

if TYPE_CHECKING:
    from gaitopt.tuning.controller_family import ControllerFamily

OPEN_LOOP = "feedforward"
HEADROOM = 1.2
"""Default torque limit of a law relative to the limit of the plan."""


def feedback_named(
    name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Callable[[Gait, Robot], Law] | None:
    """Return a function that makes the law of a saved gait, or None if its torques are played back."""
    if name == OPEN_LOOP and not gains and not stance_angle:
        return None
    return functools.partial(law_for, name=name, gains=gains, torque_limit=torque_limit, stance_angle=stance_angle)


def law_for(
    gait: Gait, robot: Robot, name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Law:
    """Return a law for a gait by name; gains that are not given as NAME=VALUE keep their defaults."""
    if name == OPEN_LOOP:
        if gains:
            raise InputError("The feedforward torques of a gait have no gains; name a feedback law with --law.")
        played = feedforward(robot, gait.motion)
        return by_stance_angle(robot, gait.motion, played) if stance_angle else played
    design = design_for(gait, robot, name, torque_limit, stance_angle)
    values = {each.name: each.start for each in design.gains}
    for gain, value in read_numbers(gains, "--gain").items():
        if gain not in values:
            raise InputError(f"The law {design.name!r} has no gain {gain!r}. {suggest(gain, values)}")
        values[gain] = value
    return design.law(values)


def law_title(name: str, stance_angle: bool) -> str:
    """Return the name of a law for tables.

    Examples
    --------
    >>> law_title("computed-torque", stance_angle=True)
    'computed_torque by stance angle'
    """
    from gaitopt.tuning.controller_family import law_name

    title = "open loop" if name == OPEN_LOOP else law_name(name)
    return f"{title} by stance angle" if stance_angle else title


def design_for(
    gait: Gait, robot: Robot, name: str, torque_limit: float | None, stance_angle: bool
) -> "ControllerFamily":
    """Return the design of a law for a gait by name."""
    from gaitopt.tuning.controller_family import controller_family_named

    design = controller_family_named(name, robot, gait.motion, torque_limit=limit_for(gait, torque_limit))
    return design.by_stance_angle(robot, gait.motion) if stance_angle else design


def limit_for(gait: Gait, torque_limit: float | None) -> float | dict[str, float]:
    """Return the torque limit of a law: `torque_limit`, or `HEADROOM` times the limit of each actuator in the plan.

    Raises
    ------
    InputError
        If the limit is not positive, or an actuator of the plan has no torque.
    """
    if torque_limit is not None:
        if not torque_limit > 0:
            raise InputError(f"--torque-limit must be positive, got {torque_limit:g}.")
        return torque_limit
    planned = gait.problem.get("torque_limit", math.inf)
    by_name = planned if isinstance(planned, dict) else dict.fromkeys(gait.motion.actuators, planned)
    for name, limit in by_name.items():
        if not float(limit) > 0:
            raise InputError(
                f"The gait is planned without torque at the {name}; set the torque limit of feedback with "
                "--torque-limit, or plan the gait for a robot without that actuator."
            )
    return {name: HEADROOM * float(limit) for name, limit in by_name.items()}
