"""From a decision vector back to a motion."""

import functools

import casadi as ca
import numpy as np

from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.sampling import make_jump, make_motion, make_segment
from gaitopt.ocp.grid import Phase
from gaitopt.ocp.shooting import Transcription
from gaitopt.ocp.stance import Stance, rk4


def read_motion(transcription: Transcription, values: dict[str, float], x: Array) -> Motion:
    """Return the planned step, sampled at nodes and mid-intervals.

    Parameters
    ----------
    transcription : Transcription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    p = transcription.robot.vector(values)
    segments: list[Segment] = []
    time, place = 0.0, 0.0
    for phase, stance in zip(transcription.phases, transcription.stances, strict=True):
        segment = _segment(transcription, phase, stance, x, p, time, place)
        segments.append(segment)
        time, place = segment.time[-1], segment.q[0, -1]
    jump = _jump(transcription, x, p, segments[-1])
    return make_motion(transcription.robot, values, tuple(segments), (jump,))


def _segment(
    transcription: Transcription, phase: Phase, stance: Stance, x: Array, p: Array, time: float, place: float
) -> Segment:
    robot, layout, count, n_u = transcription.robot, transcription.variables, phase.count, transcription.robot.n_u
    state, torque = planned_states(transcription, phase, x)
    duration = x[layout["duration"][0, phase.number]]
    zero = np.zeros((n_u + 1, count))
    middle, end = (
        np.asarray(part)
        for part in _sampler(stance, count, transcription.substeps)(
            np.vstack([state[:, :-1], zero]), torque[:, :-1], torque[:, 1:], duration / count, p
        )
    )
    n_x, samples = stance.n_x, 2 * count + 1
    states, torques, energy = np.empty((n_x, samples)), np.empty((n_u, samples)), np.zeros((n_u + 1, samples))
    states[:, ::2], states[:, 1::2] = state, middle[:n_x]
    torques[:, ::2], torques[:, 1::2] = torque, (torque[:, :-1] + torque[:, 1:]) / 2
    done = np.cumsum(end[n_x:], axis=1)
    energy[:, 2::2] = done
    energy[:, 1::2] = done - end[n_x:] + middle[n_x:]

    n = len(robot.angles)
    slide, speed = (states[2 * n], states[2 * n + 1]) if phase.mode.slips else np.zeros((2, samples))
    still = np.zeros(samples)
    return make_segment(
        robot,
        p,
        mode=phase.mode,
        step=0,
        time=time + np.linspace(0, duration, samples),
        q=np.vstack([place + slide, still, states[:n]]),
        v=np.vstack([speed, still, states[n : 2 * n]]),
        torque=torques,
        work=energy[:n_u],
        friction_work=energy[n_u],
    )


@functools.lru_cache(maxsize=64)
def _sampler(stance: Stance, count: int, substeps: int) -> ca.Function:
    """Return (states, torque, torque after, step, p) -> (middle, end) of all intervals, works included."""
    state, step = ca.SX.sym("state", stance.n_x + stance.robot.n_u + 1), ca.SX.sym("step")
    torque, after = ca.SX.sym("torque", stance.robot.n_u), ca.SX.sym("after", stance.robot.n_u)
    p = ca.SX.sym("p", len(stance.robot.parameters))
    outputs = list(stance.interval(state, torque, after, step, p, substeps=substeps, energy=True))
    single = ca.Function("sample", [state, torque, after, step, p], outputs)
    return single.map("samples", "serial", count, [3, 4], [])


def error_between_nodes(transcription: Transcription, values: dict[str, float], x: Array) -> float:
    """Return how far the plan drifts from its own nodes when each phase is integrated with four times the steps.

    Every phase is followed from its first node under the planned torques; the largest difference of a state from a node
    is returned (rad, rad/s, m, m/s).
    """
    p, worst, parts = transcription.robot.vector(values), 0.0, 8 * transcription.substeps
    for phase, stance in zip(transcription.phases, transcription.stances, strict=True):
        states, torque = planned_states(transcription, phase, x)
        count = phase.count * parts
        step = x[transcription.variables["duration"][0, phase.number]] / count
        between = np.arange(count + 1) / parts
        fine = np.array([np.interp(between, np.arange(phase.count + 1), row) for row in torque])
        follow, parameters = _follower(stance, count), np.tile(p[:, None], count)
        ends = np.asarray(follow(states[:, 0], fine[:, :-1], fine[:, 1:], np.full((1, count), step), parameters))
        worst = max(worst, float(np.max(np.abs(ends[:, parts - 1 :: parts] - states[:, 1:]))))
    return worst


@functools.lru_cache(maxsize=64)
def _follower(stance: Stance, count: int) -> ca.Function:
    """Return (first state, torques, torques after, step, p) -> states after each of `count` Runge-Kutta steps."""
    state, step = ca.SX.sym("state", stance.n_x), ca.SX.sym("step")
    torque, after = ca.SX.sym("torque", stance.robot.n_u), ca.SX.sym("after", stance.robot.n_u)
    p = ca.SX.sym("p", len(stance.robot.parameters))
    torques = (torque, (torque + after) / 2, after)
    end = rk4(lambda at, u: stance.flow(at, u, p)[0], state, torques, step)
    return ca.Function("step", [state, torque, after, step, p], [end]).mapaccum("follow", count)


def planned_states(transcription: Transcription, phase: Phase, x: Array) -> tuple[Array, Array]:
    """Return the reduced states and the torques at the nodes of a phase, shapes (n_x, N+1) and (n_u, N+1)."""
    layout, nodes = transcription.variables, list(phase.nodes)
    columns = [layout["angles"][:, nodes], layout["rates"][:, nodes]]
    if phase.mode.slips:
        columns.append(layout[f"slide {phase.number}"])
    return x[np.vstack(columns)], x[layout["torque"][:, nodes]]


def _jump(transcription: Transcription, x: Array, p: Array, last: Segment) -> Jump:
    robot, layout, first = transcription.robot, transcription.variables, transcription.phases[0]
    speed = x[layout[f"slide {first.number}"][1, 0]] if first.mode.slips else 0.0
    v_next = np.concatenate([[speed, 0.0], x[layout["rates"][:, 0]]])
    q = last.q[:, -1]
    return make_jump(
        robot,
        p,
        step=0,
        time=float(last.time[-1]),
        mode=transcription.word.impact,
        impulse=x[layout["impulse"][:, 0]],
        q=q,
        v_minus=last.v[:, -1],
        v_plus=np.asarray(robot.unswap(q, v_next, p)).ravel(),
    )
