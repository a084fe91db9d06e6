"""The control law of a command: a family by name, a function of a script, or a file of tuned gains."""

import functools
import math
import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.output import err
from gaitopt.errors import InputError
from gaitopt.tuning.law_script import split_script_law

if TYPE_CHECKING:  # the modules of the laws are imported when a law is made
    from gaitopt.control.law import Law
    from gaitopt.model.robot import Robot
    from gaitopt.motion.gait import Gait
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.tuning.controller_family import ControllerFamily
    from gaitopt.tuning.tuning_file import TunedGains

OPEN_LOOP = "feedforward"
HEADROOM = 1.2
"""Default torque limit of a law relative to the limit of the plan."""
FEW_GAINS = 6
"""Number of gains that are stated with the name of a law."""


def find_feedback(
    name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> "Callable[[AnyGait, Any], Any] | None":
    """Return a function that makes the law of a saved gait, or None if its torques are replayed."""
    if name == OPEN_LOOP and not gains and torque_limit is None and not stance_angle:
        return None
    return functools.partial(law_for, name=name, gains=gains, torque_limit=torque_limit, stance_angle=stance_angle)


def law_for(
    gait: "AnyGait", robot: Any, name: str, gains: list[str] | None, torque_limit: float | None, stance_angle: bool
) -> Any:
    """Return a law for a gait, a Law or PlanarLaw; gains not given as NAME=VALUE keep defaults or tuned values."""
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.motion.planar_gait import PlanarGait

    if isinstance(gait, PlanarGait):
        return PlanarLawOption(name, gains or [], torque_limit, stance_angle).make(gait)
    if name == OPEN_LOOP:
        from gaitopt.control.law import feedforward
        from gaitopt.control.phase_variable import by_stance_angle

        if gains:
            raise InputError("The feedforward torques of a gait have no gains; name a feedback law with --law.")
        if torque_limit is not None:
            raise InputError("The feedforward torques of a gait have no limit to set; name a feedback law with --law.")
        law = feedforward(robot, gait.motion)
        return by_stance_angle(robot, gait.motion, law) if stance_angle else law
    from gaitopt.cli.script_law import make_family_law

    design, tuned = design_for(gait, robot, name, torque_limit, stance_angle), dict[str, float]()
    if is_file_of_gains(name):
        from gaitopt.tuning.tuning_file import load_tuning

        saved = load_tuning(name)
        saved.check_gains(design)
        tuned.update(saved.gains)
    custom: Law = make_family_law(design, tuned, gains)
    return custom


def law_of_gait(
    gait: "AnyGait",
    name: str,
    gains: list[str] | None = None,
    torque_limit: float | None = None,
    stance_angle: bool = False,
) -> Any:
    """Return the law of a gait, a Law or PlanarLaw, from the options of a command."""
    return law_for(gait, gait.robot, name, gains, torque_limit, stance_angle)


def law_title(name: str, stance_angle: bool) -> str:
    """Return the name of a law for tables.

    Examples
    --------
    >>> law_title("computed-torque", stance_angle=True)
    'computed_torque by stance angle'
    """
    if is_file_of_gains(name):
        from gaitopt.tuning.tuning_file import load_tuning

        tuned = load_tuning(name)
        name, stance_angle = tuned.family, stance_angle or tuned.settings.stance_angle
    from gaitopt.tuning.controller_family import law_name

    title = "open loop" if name == OPEN_LOOP else name if split_script_law(name) else law_name(name)
    return f"{title} by stance angle" if stance_angle else title


def describe_law(name: str, stance_angle: bool, gains: Mapping[str, float] | None = None) -> str:
    """Return the name of a feedback law with its gains if they are few; empty for the open loop.

    Examples
    --------
    >>> describe_law("pd", False, {"stiffness": 90.0, "damping": 18.0})
    'joint_pd, stiffness 90 N m/rad, damping 18 N m s/rad'
    """
    from gaitopt.tuning.gain_units import format_gains

    if name == OPEN_LOOP and not stance_angle:
        return ""
    title = law_title(name, stance_angle)
    return f"{title}, {format_gains(title.split()[0], gains)}" if gains and len(gains) <= FEW_GAINS else title


def is_file_of_gains(name: str) -> bool:
    """Return whether a law is a file of tuned gains."""
    return Path(name).suffix == ".json"


def design_for(
    gait: "Gait", robot: "Robot", name: str, torque_limit: float | None, stance_angle: bool
) -> "ControllerFamily":
    """Return the family of laws for a gait: by name, of a script as SCRIPT.py:FUNCTION, or of a file of tuned gains."""
    from gaitopt.cli.script_law import custom_design, require_function_name
    from gaitopt.tuning.controller_family import controller_family_named

    require_function_name(name)
    limit: float | Mapping[str, float]
    tuned: TunedGains | None = None
    if is_file_of_gains(name):
        from gaitopt.tuning.tuning_file import load_tuning

        tuned = load_tuning(name)
        limit = limit_for(gait, torque_limit) if torque_limit is not None else tuned.settings.torque_limit
        require_known_law(name, tuned, gait)
        name = tuned.family
        stance_angle = stance_angle or tuned.settings.stance_angle
    else:
        limit = limit_for(gait, torque_limit)
    if source := split_script_law(name):
        design = custom_design(*source, robot, gait.motion, limit)
    else:
        design = controller_family_named(name, robot, gait.motion, torque_limit=limit)
    if stance_angle:
        design = design.by_stance_angle(robot, gait.motion)
    if tuned is None:
        return design
    tuned.check_gains(design, complete=False)
    return design.with_starts(tuned.gains)


def require_known_law(file: str, tuned: "TunedGains", gait: "AnyGait") -> None:
    """Raise InputError if a file of tuned gains is of other actuators, or names no known law.

    A warning is printed if the script of the law has changed, or the gains were tuned for another gait.  Known are the
    families of gaitopt and functions of scripts.
    """
    from gaitopt.tuning.controller_family import FAMILIES
    from gaitopt.tuning.tuned_gait import compare_gaits

    limits, actuators = tuned.settings.torque_limit, gait.motion.actuators
    if isinstance(limits, Mapping) and set(limits) - set(actuators):
        raise InputError(
            f"{file} contains gains of a robot with the actuators {', '.join(limits)}, but {gait.robot_name} has "
            f"{', '.join(actuators)}. To tune this law for the gait: gaitopt tune GAIT --law {tuned.family}."
        )
    if tuned.script_changed:
        _warn_of_changed_script(file, tuned.family)
    former, present = compare_gaits(tuned.gait, gait)
    if former:
        _warn_of_another_gait(file, former, present)
    if tuned.family in FAMILIES or split_script_law(tuned.family):
        return
    gains = " ".join(f"--gain {shlex.quote(f'{name}={value:.10g}')}" for name, value in tuned.gains.items())
    raise InputError(
        f"The custom law {tuned.family!r} of {file} was tuned in Python; the file does not name its script. Write a "
        f"function (robot, motion, torque_limit) that returns the law, and use --law SCRIPT.py:FUNCTION {gains}; or "
        "tune ControllerFamily.from_law(law, name='SCRIPT.py:FUNCTION'), so that the saved file names the function."
    )


@functools.cache
def _warn_of_changed_script(file: str, law: str) -> None:
    """Print once that the script of tuned gains has changed; commands may make the law several times."""
    err.print(
        f"The script of the law {law} has changed since the gains of {file} were tuned: the stability and the recovery "
        "that the file states may no longer be those of the law.",
        soft_wrap=True,
    )


@functools.cache
def _warn_of_another_gait(file: str, former: str, present: str) -> None:
    """Print once that gains were tuned for another gait; commands may make the law several times."""
    err.print(
        f"warning: the gains of {file} were tuned for another gait ({former}); this gait has {present}. The stability "
        "and the recovery that the file states are those of the other gait.",
        soft_wrap=True,
        markup=False,
    )


def limit_for(gait: "Gait", torque_limit: float | None) -> float | dict[str, float]:
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
