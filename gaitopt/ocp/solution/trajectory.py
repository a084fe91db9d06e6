"""From a decision vector back to a motion."""

import functools
import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.integrate import DOP853

from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.sampling import SegmentSamples, TouchdownState, make_jump, make_motion, make_segment
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.reductions import worst

STEPS = 50
"""Least number of Runge-Kutta steps, for the whole period, by which a plan is read and checked."""


def solved_parameters(transcription: Transcription, problem: GaitProblem, x: Array) -> dict[str, float]:
    """Return every parameter by name, the slope as found where it was free."""
    if Unknown.SLOPE not in transcription.variables:
        return problem.values
    return problem.values | {"slope": float(x[transcription.variables[Unknown.SLOPE][0, 0]])}


def read_motion(transcription: Transcription, values: dict[str, float], x: Array) -> Motion:
    """Return the planned step, sampled at nodes and mid-intervals, where it is integrated from the node before.

    Parameters
    ----------
    transcription : Transcription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    p = transcription.structure.robot.vector(values)
    segments: list[Segment] = []
    time, place = 0.0, 0.0
    for phase, stance in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        segment = _segment(transcription, phase, stance, x, p, time, place)
        segments.append(segment)
        time, place = segment.time[-1], segment.q[0, -1]
    jump = _jump(transcription, x, p, segments[-1])
    return make_motion(transcription.structure.robot, values, tuple(segments), (jump,))


def _segment(
    transcription: Transcription, phase: Phase, stance: PhaseDynamics, x: Array, p: Array, time: float, place: float
) -> Segment:
    robot, layout, count = transcription.structure.robot, transcription.variables, phase.count
    n_u, n_works = robot.n_u, robot.n_works
    state, torque = planned_states(transcription, phase, x)
    duration = x[layout[Unknown.DURATION][0, phase.number]]
    begun, parts = np.vstack([state[:, :-1], np.zeros((n_works, count))]), _parts(transcription, phase, x)
    middle, end = _halve_interval(stance, begun, _subdivided(torque, parts), duration / count, p)
    n_x, samples = stance.n_x, 2 * count + 1
    states, torques, energy = np.empty((n_x, samples)), np.empty((n_u, samples)), np.zeros((n_works, samples))
    states[:, ::2], states[:, 1::2] = state, middle[:n_x]
    torques[:, ::2], torques[:, 1::2] = torque, (torque[:, :-1] + torque[:, 1:]) / 2
    done = np.cumsum(end[n_x:], axis=1)
    energy[:, 2::2] = done
    energy[:, 1::2] = done - end[n_x:] + middle[n_x:]

    n = len(robot.angles)
    slide, speed = (states[2 * n], states[2 * n + 1]) if phase.mode.slips else np.zeros((2, samples))
    still = np.zeros(samples)
    sampled = SegmentSamples(
        mode=phase.mode,
        step=0,
        time=time + np.linspace(0, duration, samples),
        q=np.vstack([place + slide, still, states[:n]]),
        v=np.vstack([speed, still, states[n : 2 * n]]),
        torque=torques,
        work=energy[:n_u],
        friction_work=energy[n_u],
        damping_work=energy[-1] if robot.has_dampers else None,
    )
    return make_segment(robot, p, sampled)


@dataclass(frozen=True, eq=False)
class BetweenNodes:
    """What a plan does between its nodes, followed from the first node of the step with small steps.

    Attributes
    ----------
    drift : float
        Largest difference of a state from a node (rad, rad/s, m, m/s).
    outside : float
        Largest share by which a force leaves the friction cone or pulls, or speed [m/s] by which a foot slides the
        wrong way; constraints hold at nodes and inner points only.
    """

    drift: float
    outside: float


def check_between_nodes(transcription: Transcription, values: dict[str, float], x: Array) -> BetweenNodes:
    """Follow a plan between its nodes under the planned torques."""
    robot, drift, outside = transcription.structure.robot, 0.0, 0.0
    p, swung, reached = robot.vector(values), 2 * len(robot.angles), np.empty(0)
    for phase, stance in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        states, torque = planned_states(transcription, phase, x)
        parts = _parts(transcription, phase, x)
        step = x[transcription.variables[Unknown.DURATION][0, phase.number]] / (phase.count * parts)
        begun = np.concatenate([reached, states[reached.size :, 0], np.zeros(robot.n_works)])
        fine = _subdivided(torque, parts)
        follow = _follower(stance, parts * phase.count, 1)
        ends = np.asarray(follow(begun, fine[:, :-1], fine[:, 1:], step, p))[: stance.n_x]
        drift = worst(drift, np.abs(ends[:, parts - 1 :: parts] - states[:, 1:]))
        reached = ends[:swung, -1]  # the foot's own motion begins anew with each phase
        static = float(stance.robot.static_friction(p))
        outside = worst(outside, _violation_between(stance, ends[:, :-1], fine[:, 1:-1], p, static))
    return BetweenNodes(drift, outside)


def _violation_between(stance: PhaseDynamics, states: Array, torque: Array, p: Array, friction: float) -> float:
    """Return by how much a contact mode is violated at some states."""
    found = _forces(stance, states.shape[1])(states, torque, p)
    tangential, normal = np.asarray(found)
    pulls = np.where(np.isfinite(normal), normal <= 0, np.inf)
    if stance.mode.slips:
        return worst(-stance.mode.sign * states[-1], pulls)
    with np.errstate(over="ignore"):  # a force that pulls is outside of any cone
        cone = np.abs(tangential) / friction / np.maximum(normal, 1e-300) - 1
    return worst(cone if math.isfinite(friction) else 0.0, pulls)


@functools.lru_cache(maxsize=64)
def _forces(stance: PhaseDynamics, count: int) -> ca.Function:
    """Return (states, torques, p) -> contact forces (2, count)."""
    state, torque = ca.SX.sym("state", stance.n_x), ca.SX.sym("torque", stance.robot.n_u)
    p = ca.SX.sym("p", len(stance.robot.parameters))
    single = ca.Function("force", [state, torque, p], [stance.flow(state, torque, p)[1]])
    return single.map("forces", "serial", count, [2], [])


def _parts(transcription: Transcription, phase: Phase, x: Array) -> int:
    """Return the Runge-Kutta steps of each interval of a phase: a power of two, so few functions are built.

    At least four: a force that leaves its cone just behind a node is met at a quarter of the interval at the latest.
    """
    durations = x[transcription.variables[Unknown.DURATION][0]]
    steps = STEPS * durations[phase.number] / (durations.sum() * phase.count)
    return int(2 ** max(2, math.ceil(math.log2(steps))))


def _halve_interval(stance: PhaseDynamics, begun: Array, fine: Array, length: float, p: Array) -> tuple[Array, Array]:
    """Return the states, works included, in the middle and at the end of intervals that begin at given states.

    `fine` are the torques at the ends of all Runge-Kutta steps, `length` is that of an interval [s].
    """
    count = begun.shape[1]
    parts = (fine.shape[1] - 1) // count
    follow = _follower(stance, parts, count)
    ends = np.asarray(follow(begun, fine[:, :-1], fine[:, 1:], length / parts, p))
    return ends[:, parts // 2 - 1 :: parts], ends[:, parts - 1 :: parts]


def _subdivided(torque: Array, parts: int) -> Array:
    """Return torques at the ends of all Runge-Kutta steps, linear between the nodes' own."""
    count = torque.shape[1] - 1
    at = np.linspace(0, count, parts * count + 1)
    return np.array([np.interp(at, np.arange(count + 1), row) for row in torque])


@functools.lru_cache(maxsize=64)
def _follower(stance: PhaseDynamics, steps: int, count: int) -> ca.Function:
    """Return (states and works, torques, torques after, step, p) -> the same after each of some Runge-Kutta steps.

    The steps follow each other from each of `count` states, whose torques and ends lie side by side.
    """
    chain = _one_step(stance).mapaccum("chain", steps)
    return chain if count == 1 else chain.map("follow", "serial", count, [3, 4], [])


@functools.lru_cache(maxsize=64)
def _one_step(stance: PhaseDynamics) -> ca.Function:
    """Return (state and works, torque, torque after, step, p) -> the same after one Runge-Kutta step of order 8."""
    state, torque = ca.SX.sym("state", stance.n_x + stance.robot.n_works), ca.SX.sym("torque", stance.robot.n_u)
    p = ca.SX.sym("p", len(stance.robot.parameters))
    rate = ca.Function("rate", [state, torque, p], ca.cse([stance.flow_and_energy(state, torque, p)]))
    begun, held, after, data = (ca.MX.sym(name, rate.size1_in(i)) for name, i in zip("xuvp", (0, 1, 1, 2), strict=True))
    step = ca.MX.sym("h")
    slopes = ca.MX(state.numel(), 0)
    for row, c in zip(DOP853.A, DOP853.C, strict=True):
        at = begun + step * (slopes @ ca.DM(row[: slopes.shape[1]]))
        slopes = ca.horzcat(slopes, rate(at, held + c * (after - held), data))
    return ca.Function("step", [begun, held, after, step, data], [begun + step * (slopes @ ca.DM(DOP853.B))])


def planned_states(transcription: Transcription, phase: Phase, x: Array) -> tuple[Array, Array]:
    """Return the reduced states and the torques at the nodes of a phase, shapes (n_x, N+1) and (n_u, N+1)."""
    layout, nodes = transcription.variables, list(phase.nodes)
    columns = [layout[Unknown.ANGLES][:, nodes], layout[Unknown.RATES][:, nodes]]
    if phase.mode.slips:
        columns.append(layout[Unknown.SLIDE, phase.number])
    return x[np.vstack(columns)], x[layout[Unknown.TORQUE][:, nodes]]


def _jump(transcription: Transcription, x: Array, p: Array, last: Segment) -> Jump:
    robot, layout, first = transcription.structure.robot, transcription.variables, transcription.phases[0]
    speed = x[layout[Unknown.SLIDE, first.number][1, 0]] if first.mode.slips else 0.0
    v_next = np.concatenate([[speed, 0.0], x[layout[Unknown.RATES][:, 0]]])
    q = last.q[:, -1]
    touchdown = TouchdownState(
        step=0,
        time=float(last.time[-1]),
        mode=transcription.structure.sequence.impact,
        impulse=x[layout[Unknown.IMPULSE][:, 0]],
        q=q,
        v_minus=last.v[:, -1],
        v_plus=np.asarray(robot.unswap(q, v_next, p)).ravel(),
    )
    return make_jump(robot, p, touchdown)
