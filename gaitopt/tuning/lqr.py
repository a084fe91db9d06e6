"""Time-varying linear-quadratic feedback along a gait, through its events, and step-to-step on its return map."""

import functools
import math
from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, feedforward
from gaitopt.control.state_feedback import state_feedback
from gaitopt.control.step_to_step import step_to_step
from gaitopt.errors import InputError, NoGaitError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.printable import format_count
from gaitopt.parameters import Parameter, positive
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep, make_walker
from gaitopt.stability.fixed_point import find_fixed_point
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.tuning.riccati import LinearInterval, discrete_gains, periodic_gains

MOST_WINDOWS = 20
"""Largest number of windows of a step."""


@check_arguments
@frozen(kw_only=True)
class LqrWeights:
    """Scaling of the cost of linear-quadratic feedback (Bryson's rule): a deviation or torque of this size costs 1.

    Attributes
    ----------
    angle : float [rad]
    rate : float [rad/s]
    foot_speed : float [m/s]
    torque : float [N m]

    Raises
    ------
    InputError
        If a size is not positive and finite.

    Examples
    --------
    >>> LqrWeights(torque=2.0).angle
    0.05
    """

    angle: float = field(default=0.05, validator=positive("rad"))
    rate: float = field(default=0.3, validator=positive("rad/s"))
    foot_speed: float = field(default=0.3, validator=positive("m/s"))
    torque: float = field(default=5.0, validator=positive("N m"))


@check_arguments
def lqr(
    robot: Robot,
    motion: Motion,
    *,
    weights: LqrWeights | None = None,
    torque_limit: float | Mapping[str, float] = math.inf,
) -> Law:
    """Return the time-varying linear-quadratic law of a gait, designed through its contact events.

    The design uses the linearised dynamics of the contact mode between events and the saltation matrix, which includes
    the change of the event time, at each event; the cost-to-go is periodic over the step.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        One step of a periodic gait.
    weights : LqrWeights, optional
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the replay of the motion's torques does not reproduce the motion, or no feedback stabilises it.

    Examples
    --------
    >>> from gaitopt import compass_biped, load, lqr
    >>> lqr(compass_biped(), load("docs/examples/compass_slip.h5").motion).name
    'lqr'
    """
    check_robot_type(robot, Robot, "a Robot such as compass_biped()", "planar_lqr")
    weights = weights or LqrWeights()
    n_a = len(robot.angles)
    sizes = [weights.angle] * n_a + [weights.foot_speed] + [weights.rate] * n_a
    solution = periodic_gains(
        _linearise(robot, motion), np.diag(1 / np.square(sizes)), np.eye(robot.n_u) / weights.torque**2
    )
    if solution is None:
        raise InputError(f"No linear-quadratic feedback stabilises this gait with {weights}; try other weights.")
    return state_feedback(robot, motion, solution[0], torque_limit=torque_limit, name="lqr")


@check_arguments
def step_lqr(
    robot: Robot,
    motion: Motion,
    *,
    law: Law | None = None,
    windows: int = 2,
    weights: LqrWeights | None = None,
    torque_limit: float | Mapping[str, float] = math.inf,
) -> Law:
    """Return the discrete linear-quadratic law of a gait's return map: torques constant over windows of each step.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        One step of a periodic gait.
    law : Law, optional
        Law without limits to which the torques are added; by default the open-loop torques of the gait.
    windows : int
        Number of equal parts of the step.
    weights : LqrWeights, optional
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the law has no periodic gait near the planned one, or no feedback stabilises it.

    Examples
    --------
    >>> from gaitopt import compass_biped, load, step_lqr
    >>> step_lqr(compass_biped(), load("docs/examples/compass_slip.h5").motion).name
    'step_lqr'
    """
    check_robot_type(robot, Robot, "a Robot such as compass_biped()", "planar_step_lqr")
    Parameter("windows", 2, "1", "", lower=1, upper=MOST_WINDOWS, whole=True).check(windows)
    weights = weights or LqrWeights()
    base, first = law or feedforward(robot, motion), motion.segments[0]
    p = robot.vector(motion.parameters)
    section = Section(robot, p, sliding=True)
    n_z, n_a = len(section.names), len(robot.angles)
    start = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    add_feedback = functools.partial(step_to_step, robot, base, windows=windows, duration=motion.period)
    zero_feedback = add_feedback(start, np.zeros((windows * robot.n_u, n_z)))
    walker = make_walker(robot, zero_feedback, motion.parameters, period=motion.period)
    point = find_fixed_point(ReturnMap(walker, section), start)
    if point is None:
        raise NoGaitError(
            f"No periodic gait of the walker under the law {base.name!r} was found near the planned one; check the "
            "gait with verify, or use another law."
        )
    effect = Linearisation(walker).latched_effect(point.passage.states[0], point.passage.walk_steps[0])[section.places]
    sizes = [weights.angle] * (n_a - 1) + [weights.rate] * n_a + [weights.foot_speed]
    torque_cost = np.eye(windows * robot.n_u) / weights.torque**2
    gain = discrete_gains(point.derivative, effect, np.diag(1 / np.square(sizes)), torque_cost)
    if gain is None:
        raise InputError(
            f"No step-to-step feedback with {format_count(windows, 'interval')} per step (windows) stabilises this "
            f"gait with {weights}; try other weights or another number of windows."
        )
    return replace(add_feedback(point.z, gain, torque_limit=torque_limit), name="step_lqr")


def _first_walk_step(walker: Walker, motion: Motion) -> WalkStep:
    """Return the simulated step under the motion's torques, which must have the phases of the motion."""
    first = motion.segments[0]
    walk_step = walker.walk_step(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    sequence = motion.sequence(first.step)
    planned = None if sequence is None else (*sequence.phases, sequence.impact)
    outcome = walk_step.impact.mode if walk_step.impact is not None else None
    if walk_step.following is None or (*walk_step.modes, outcome) != planned:
        raise InputError(
            "The replay of the motion's torques must reproduce the motion, but does not; check the gait with verify."
        )
    return walk_step


@functools.lru_cache(maxsize=8)
def _linearise(robot: Robot, motion: Motion) -> tuple[LinearInterval, ...]:
    """Return the linearised dynamics of a gait in (angles, foot speed, rates) with the jumps at events."""
    entries = robot.state_entries
    indices = [*entries.angles, entries.slip_velocity, *entries.rates]
    walker = make_walker(robot, feedforward(robot, motion), motion.parameters, period=motion.period)
    jumps = Linearisation(walker).saltations(_first_walk_step(walker, motion))
    segments = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    intervals: list[LinearInterval] = []
    for segment, jump in zip(segments, jumps, strict=True):
        parts = _linearise_segment(
            robot, walker.p, segment.mode, segment.time, np.vstack([segment.q, segment.v]), segment.torque
        )
        for k, (duration, a, b) in enumerate(parts):
            at_end = jump[np.ix_(indices, indices)] if k + 1 == len(parts) else np.eye(len(indices))
            intervals.append(LinearInterval(duration, a[np.ix_(indices, indices)], b[indices], at_end))
    return tuple(intervals)


def _linearise_segment(
    robot: Robot, p: Array, mode: Mode, time: Array, states: Array, torque: Array
) -> list[tuple[float, Array, Array]]:
    """Return duration, A and B of the linearised dynamics between samples, evaluated at the midpoints."""
    slope, parts = _slopes(robot, mode), list[tuple[float, Array, Array]]()
    for k in np.flatnonzero(np.diff(time) > 0):
        a, b = slope((states[:, k] + states[:, k + 1]) / 2, (torque[:, k] + torque[:, k + 1]) / 2, p)
        parts.append((float(time[k + 1] - time[k]), np.asarray(a), np.asarray(b)))
    return parts


@functools.lru_cache(maxsize=32)
def _slopes(robot: Robot, mode: Mode) -> ca.Function:
    """Return (y, u, p) -> d y' / d y, d y' / d u of a contact mode."""
    n = robot.n_q
    y, u, p = ca.SX.sym("y", 2 * n), ca.SX.sym("u", robot.n_u), ca.SX.sym("p", len(robot.parameters))
    rate = ca.vertcat(y[n:], robot.acceleration[mode](y[:n], y[n:], u, p)[0])
    return ca.Function("slopes", [y, u, p], [ca.densify(ca.jacobian(rate, y)), ca.densify(ca.jacobian(rate, u))])
