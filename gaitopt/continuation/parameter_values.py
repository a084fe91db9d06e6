"""Parameters of robot, ground and law over which gaits are followed."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.quantity_labels import state_value
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.walk_problem import WalkProblem

AnyRobot = Robot | PlanarRobot
SomeLaw = TypeVar("SomeLaw", Law, PlanarLaw)


def gains_of(law: object) -> dict[str, float]:
    """Return the gains of a law by name; a torque that is no law has none.

    Examples
    --------
    >>> gains_of(None)
    {}
    """
    return dict(law.gain_values) if isinstance(law, Law | PlanarLaw) else {}


def law_of(problem: WalkProblem | PlanarWalkProblem) -> object:
    """Return the law of a walking problem, None without one.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> law_of(WalkProblem(robot=compass_biped())) is None
    True
    """
    return problem.torque if isinstance(problem, PlanarWalkProblem) else problem.law


def unit_of(robot: AnyRobot, name: str) -> str:
    """Return the unit of a parameter of a robot; a gain of a law has none.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> unit_of(compass_biped(), "slope"), unit_of(compass_biped(), "hip_stiffness")
    ('rad', '')
    """
    return next((each.unit for each in robot.parameters if each.name == name), "")


def set_gains(robot: AnyRobot, law: SomeLaw, values: Mapping[str, float]) -> SomeLaw:
    """Return a law with those values that are its gains; a parameter of the robot is no gain.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    law : Law or PlanarLaw
    values : mapping of str to float
        Values of any parameters.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> from gaitopt.control import passive
    >>> set_gains(compass_biped(), passive(compass_biped()), {"slope": 0.1}).gain_values
    {}
    """
    known = {each.name for each in robot.parameters}
    gains = {name: values[name] for name in gains_of(law) if name in values and name not in known}
    return law.with_gains(gains) if gains else law


def check_range(problem: WalkProblem | PlanarWalkProblem, parameter: str, ends: tuple[float, float]) -> None:
    """Raise InputError unless robot or law have a parameter and its range is finite, not empty and of valid values."""
    robot, law = problem.robot, law_of(problem)
    described = {each.name: each for each in robot.parameters}
    gains = gains_of(law)
    known = [*described, *gains]
    if parameter not in known:
        owner = f"Robot {robot.name!r}" + (f" under the law {getattr(law, 'name', '')!r}" if gains else "")
        hint = "" if gains else " Gains are those of a feedback law, which --law states."
        raise InputError(f"{owner} has no parameter {parameter!r}. {suggest(parameter, known)}{hint}")
    if not np.all(np.isfinite(ends)) or ends[0] == ends[1]:
        stated = " to ".join(state_value(end, unit_of(robot, parameter)) for end in ends)
        raise InputError(f"The range of {parameter} must have two different finite ends, got {stated}.")
    if parameter not in described:
        return
    if described[parameter].whole:
        raise InputError(
            f"{parameter} is a whole number, over which a gait cannot be followed; name another parameter."
        )
    for end in ends:
        _check_end(problem, parameter, end, ends)


def _check_end(problem: WalkProblem | PlanarWalkProblem, parameter: str, end: float, ends: tuple[float, float]) -> None:
    """Raise InputError if the robot rejects an end of a range, with the range in rad if it may be in degrees."""
    values = dict(problem.parameters)
    try:
        problem.robot.resolve(values | {parameter: end})
    except InputError as error:
        low, high = ends
        message = f"The range {low:g} to {high:g} of {parameter} is invalid: {error}"
        if unit_of(problem.robot, parameter) == "rad":
            message += f" {state_degrees(parameter, ends)}"
        raise InputError(message) from None


def state_degrees(parameter: str, ends: tuple[float, float]) -> str:
    """Return a sentence with the range in rad that is meant if the stated one is in degrees.

    Examples
    --------
    >>> state_degrees("slope", (2.0, 3.0))
    '2 to 3 deg is slope=0.0349066:0.0523599.'
    """
    low, high = np.deg2rad(ends).tolist()
    return f"{ends[0]:g} to {ends[1]:g} deg is {parameter}={low:.6g}:{high:.6g}."
