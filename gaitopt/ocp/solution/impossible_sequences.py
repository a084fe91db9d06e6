"""Contact sequences that no periodic gait can have, because of slip in one direction only or of a steep slope."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.problem import GaitProblem

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot

BALANCED = 1e-6
"""Difference of friction and tangent of the slope up to which gravity may balance the friction of a one-way slip."""

STEEP = 0.5
"""Slope beyond which it may have been stated in deg [rad]."""


def explain_impossibility(sequence: ContactSequence, problem: GaitProblem) -> str:
    """Return why no periodic gait of a problem can have a contact sequence, or "" if no known reason applies.

    Over a periodic step the tangential contact impulse balances the impulse of gravity along the slope, and the normal
    one that across it: their ratio is -tan(slope), whose absolute value is at most the coefficient of (static)
    friction.  If the foot slips in one direction in every phase and at the impact, the ratio is that of kinetic
    friction instead.  The impulses of a custom impact law may have another ratio: the balance then excludes nothing.
    An open place of a sequence stands for any mode.

    Parameters
    ----------
    sequence : ContactSequence
    problem : GaitProblem
        Its own sequence is ignored.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="slip+ | slip+", friction=0.14, speed=0.6)
    >>> print(explain_impossibility(problem.sequence, problem))
    all contacts slip forward all the time: friction 0.14 then changes the momentum along the ground in every step, \
and no periodic gait exists unless friction is tan(slope) = 0
    """
    modes = {*sequence.phases, sequence.impact}
    if any(mode.slips for mode in modes) and math.isinf(problem.friction):
        return "a foot cannot slip on infinite friction"
    law = problem.robot.contact_model.impact
    if {"friction", "slope"} & {*problem.free_ranges} or type(law) is not PlasticFrictional:
        return ""
    steep = describe_steep_slope(problem.values)
    if steep and is_free_along_ground(problem.robot, problem.values, 0):
        return steep
    if len(modes) > 1 or not sequence.impact.slips:
        return ""
    return describe_one_way_slip(sequence.impact.sign, problem.friction, problem.values["slope"])


def describe_one_way_slip(sign: int, friction: float, slope: float) -> str:
    """Return why contacts cannot slip in one direction all the time; empty if gravity balances their friction.

    Parameters
    ----------
    sign : int
        1 for slip forward, -1 for slip backward.
    friction : float
    slope : float [rad]

    Examples
    --------
    >>> describe_one_way_slip(1, 0.1, 0.0996687)
    ''
    """
    grade = math.tan(slope)
    if abs(sign * friction - grade) <= BALANCED:
        return ""
    return (
        f"all contacts slip {'forward' if sign > 0 else 'backward'} all the time: friction {friction:g} then "
        "changes the momentum along the ground in every step, and no periodic gait exists unless friction is "
        f"{'' if sign > 0 else '-'}tan(slope) = {sign * grade + 0.0:.4g}"
    )


def describe_steep_slope(values: Mapping[str, float]) -> str:
    """Return why no periodic gait exists on a slope whose tangent exceeds friction; empty if it does not.

    Parameters
    ----------
    values : mapping of str to float
        Values of all parameters of robot and ground.

    Examples
    --------
    >>> print(describe_steep_slope({"slope": 0.2, "friction": 0.1, "static_friction_ratio": 1.0}))
    tan(slope) = 0.2027 exceeds friction 0.1 on the slope of 0.2 rad (11.46 deg): gravity then changes the momentum \
along the ground in every step, and no periodic gait exists; state an absolute slope of at most 0.09967 rad \
(5.711 deg), or friction of at least 0.2027
    """
    slope = values["slope"]
    friction = values["friction"] * values.get("static_friction_ratio", 1.0)
    grade = math.tan(abs(slope))
    if grade <= friction + BALANCED:
        return ""
    largest = math.atan(friction)
    in_rad = f" if it is in deg, convert it by math.radians({slope:.4g});" if abs(slope) > STEEP else ""
    return (
        f"{'' if slope > 0 else '-'}tan(slope) = {grade:.4g} exceeds friction {friction:.4g} on the slope of "
        f"{slope:.4g} rad ({math.degrees(slope):.4g} deg): gravity then changes the momentum along the ground in every "
        f"step, and no periodic gait exists;{in_rad} state an absolute slope of at most {largest:.4g} "
        f"rad ({math.degrees(largest):.4g} deg), or friction of at least {grade:.4g}"
    )


def is_free_along_ground(robot: "Robot | PlanarRobot", values: Mapping[str, float], place: int) -> bool:
    """Return whether only gravity and contacts act on a robot along the ground: no spring, drag or actuator.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    values : mapping of str to float
        Values of all parameters.
    place : int
        Index of the coordinate along the ground.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> is_free_along_ground(compass_biped(), compass_biped().resolve({"slope": 0.1}), 0)
    True
    """
    p = np.asarray(robot.vector(dict(values)), dtype=float)
    poses = np.random.default_rng(0).uniform(-0.3, 0.3, (2, robot.n_q))
    forward, still = np.eye(robot.n_q)[place], np.zeros(robot.n_q)
    moved = poses + forward
    potential = [[float(robot.energy(q, still, p)[1]) for q in group] for group in (poses, moved)]
    change = np.diff(potential, axis=0)
    weight = float(robot.mass(p)) * values["gravity"]
    actuation = [np.asarray(robot.dynamics(q, still, p)[2])[place] for q in poses]
    drag = [np.asarray(robot.dynamics(q, q + forward, p)[1] - robot.dynamics(q, q, p)[1]) for q in poses]
    is_free = np.allclose(change, -weight * math.sin(values["slope"]), atol=1e-9 * weight)
    return is_free and np.allclose(drag, 0.0, atol=1e-9 * weight) and np.allclose(actuation, 0.0, atol=1e-9)
