"""Motion of a decision vector, and its accuracy between the nodes."""

import functools
import math

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.contacts.transition import PARADOX_MARGIN
from gaitopt.model.coordinate_entries import SLIDE, full_coordinates
from gaitopt.motion.energy import integrate_absolute
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.sampling import SegmentSamples, TouchdownState, make_jump, make_motion, make_segment
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution import runge_kutta
from gaitopt.ocp.solution.touchdown_error import predict_phase_end, predict_touchdown
from gaitopt.ocp.statement.free_parameters import clip_values
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.reductions import worst

STEPS = 50
"""Least number of Runge-Kutta steps per period by which a plan is integrated between its nodes."""

DEVIATION = 1e-9
"""Deviation from which the growth of errors is estimated (rad, rad/s)."""


def read_parameters(transcription: Transcription, problem: GaitProblem, x: Array) -> dict[str, float]:
    """Return every parameter by name, the free ones with their optimised values.

    A value outside its bounds, which a solver exceeds by its tolerance, is moved to the nearest.
    """
    layout, values = transcription.variables, problem.values
    if Unknown.SLOPE in layout:
        values = values | {"slope": float(x[layout[Unknown.SLOPE][0, 0]])}
    if Unknown.DESIGN in layout:
        optimum = zip(transcription.structure.free, x[layout[Unknown.DESIGN][:, 0]].tolist(), strict=True)
        values = clip_values(values | dict(optimum), problem.free)
    return values


@np.errstate(invalid="ignore")  # a plan that is not finite between its nodes is reported by its status
def reconstruct_motion(transcription: Transcription, values: dict[str, float], x: Array) -> Motion:
    """Return the planned step at the nodes and at mid-intervals, which are integrated from the node before.

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
    for phase, dynamics in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        segment = _segment(transcription, phase, dynamics, x, p, time, place)
        segments.append(segment)
        time, place = segment.time[-1], segment.q[SLIDE, -1]
    jump = _jump(transcription, x, p, segments[-1])
    return make_motion(transcription.structure.robot, values, tuple(segments), (jump,))


def _segment(
    transcription: Transcription, phase: Phase, dynamics: PhaseDynamics, x: Array, p: Array, time: float, place: float
) -> Segment:
    robot, layout, count = transcription.structure.robot, transcription.variables, phase.count
    n_u, n_works = robot.n_u, robot.n_works
    state, torque = read_states(transcription, phase, x)
    duration = x[layout[Unknown.DURATION][0, phase.number]]
    initial, parts = np.vstack([state[:, :-1], np.zeros((n_works, count))]), _count_steps(transcription, phase, x)
    fine = _integrate_intervals(dynamics, initial, _subdivide(torque, parts), duration * phase.shares, p)
    middle, end = fine[:, parts // 2 - 1 :: parts], fine[:, parts - 1 :: parts]
    n_x, samples = dynamics.n_x, 2 * count + 1
    states, torques, energy = np.empty((n_x, samples)), np.empty((n_u, samples)), np.zeros((n_works, samples))
    states[:, ::2], states[:, 1::2] = state, middle[:n_x]
    torques[:, ::2], torques[:, 1::2] = torque, (torque[:, :-1] + torque[:, 1:]) / 2
    total = np.cumsum(end[n_x:], axis=1)
    energy[:, 2::2] = total
    energy[:, 1::2] = total - end[n_x:] + middle[n_x:]

    q, v = dynamics.full_samples(states)
    q[SLIDE] += place
    sampled = SegmentSamples(
        mode=phase.mode,
        step=0,
        time=time + duration * np.interp(np.arange(samples) / 2, np.arange(count + 1), phase.fractions),
        q=q,
        v=v,
        torque=torques,
        work=energy[:n_u],
        friction_work=energy[n_u],
        damping_work=energy[-1] if robot.has_dampers else None,
        positive_work=_integrate_positive_power(dynamics, state[:, :1], fine, torque, duration * phase.fractions, p)[
            :, :: parts // 2
        ],
    )
    return make_segment(robot, p, sampled)


@dataclass(frozen=True, eq=False)
class BetweenNodes:
    """Accuracy of a plan between its nodes, integrated from the first node of the step with small steps.

    Attributes
    ----------
    drift : float
        Largest deviation of the integrated state from a node (rad, rad/s, m, m/s).
    outside : float
        Largest violation of a contact mode: relative excess of a force over the friction cone, or speed [m/s] of a
        slide in the wrong direction; 1 if a normal force pulls or a slip is not well posed.
    reserve : float
        Least distance to another contact mode inside the phases: share of the friction cone that a sticking force
        leaves free, or speed of a sliding foot [m/s]; inf without a friction limit.
    touchdown : float
        Largest deviation of the state after the touchdown of the integrated motion (rad, rad/s, m/s), which a replay
        finds too: errors grow at a touchdown that grazes the ground, and at an impact of low effective mass.
    """

    drift: float
    outside: float
    reserve: float = math.inf
    touchdown: float = 0.0


def check_between_nodes(
    transcription: Transcription, values: dict[str, float], x: Array, deviation: float = 0.0
) -> BetweenNodes:
    """Integrate a plan between its nodes under the planned torques, and compare it with the nodes.

    Parameters
    ----------
    transcription : Transcription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    deviation : float
        Change of the angles and rates at each end of a slip inside the step (rad, rad/s), with alternating signs.

    Returns
    -------
    BetweenNodes
    """
    robot, drift, outside, reserve = transcription.structure.robot, 0.0, 0.0, math.inf
    p, reached = robot.vector(values), np.empty(0)
    for phase, dynamics in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        states, torque = read_states(transcription, phase, x)
        parts = _count_steps(transcription, phase, x)
        duration = x[transcription.variables[Unknown.DURATION][0, phase.number]]
        steps = np.repeat(duration * phase.shares / parts, parts)
        initial = np.concatenate([reached, states[reached.size :, 0], np.zeros(robot.n_works)])
        fine = _subdivide(torque, parts)
        integrate = _build_integrator(dynamics, parts * phase.count, 1)
        ends = np.asarray(integrate(initial, fine[:, :-1], fine[:, 1:], steps[None], p))[: dynamics.n_x]
        drift = worst(drift, np.abs(ends[:, parts - 1 :: parts] - states[:, 1:]))
        visited = np.hstack([initial[: dynamics.n_x, None], ends[:, :-1]])
        violation, distance = _compare_with_mode(dynamics, visited, fine[:, :-1], steps[:-1], p)
        outside, reserve = worst(outside, violation), -worst(-reserve, -distance)
        last = dynamics, ends[:, -1], fine[:, -1], p
        if phase is not transcription.phases[-1]:
            # The slide of the foot starts from zero in each phase.
            reached = predict_phase_end(*last, transcription.phases[phase.number + 1].mode)
            if phase.mode.slips:
                reached[::2] += deviation
                reached[1::2] -= deviation
    after = predict_touchdown(*last, transcription.structure.sequence.impact)
    return BetweenNodes(drift, outside, reserve, worst(np.abs(after - _first_state(transcription, x))))


def estimate_growth(transcription: Transcription, values: dict[str, float], x: Array) -> float:
    """Return the ratio of the error after the touchdown to an error at the end of a slip inside the step, or zero."""
    if not any(phase.mode.slips for phase in transcription.phases[:-1]):
        return 0.0
    return check_between_nodes(transcription, values, x, DEVIATION).touchdown / DEVIATION


def _first_state(transcription: Transcription, x: Array) -> Array:
    """Return angles and rates (n_angles + n_q,) at the start of the step."""
    layout, first = transcription.variables, transcription.phases[0]
    speed = x[layout[Unknown.SLIDE, first.number][1, 0]] if first.mode.slips else 0.0
    return np.concatenate([x[layout[Unknown.ANGLES][:, 0]], full_coordinates(x[layout[Unknown.RATES][:, 0]], speed)])


def _compare_with_mode(
    dynamics: PhaseDynamics, states: Array, torque: Array, steps: Array, p: Array
) -> tuple[float, float]:
    """Return the largest violation of a contact mode over states, shape (n_x, K), and the reserve after the first.

    `steps` are the times between the states, shape (K - 1,) [s].
    """
    force, inertia = map(np.asarray, _build_forces(dynamics, states.shape[1])(states, torque, p))
    tangential, normal = force
    pulls = np.where(np.isfinite(normal), normal <= 0, np.inf)
    if dynamics.mode.slips:
        speed = dynamics.mode.sign * states[dynamics.speed_entry]
        return worst(-speed, pulls, inertia <= PARADOX_MARGIN), _least(speed[1:], steps[1:])
    friction = float(dynamics.robot.static_friction(p))
    with np.errstate(over="ignore"):  # a pulling force is outside any cone
        cone = np.abs(tangential) / friction / np.maximum(normal, 1e-300) - 1
    return worst(cone if math.isfinite(friction) else 0.0, pulls), -worst(cone) if math.isfinite(friction) else math.inf


def _least(speed: Array, steps: Array) -> float:
    """Return the least of some samples of a speed, `steps` apart, and of minima between them estimated by parabolas."""
    before, after, slopes = steps[:-1], steps[1:], np.diff(speed) / steps
    slope = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
    bend = 2 * np.diff(slopes) / (before + after)
    lowest = np.flatnonzero((bend * after > -slope) & (bend * before > slope) & (bend > 0))
    # The parabola lies slope^2 / (2 bend) below its middle sample; twice that covers the error of the parabola.
    return -worst(-speed, slope[lowest] ** 2 / bend[lowest] - speed[1:-1][lowest])


@functools.lru_cache(maxsize=64)
def _build_forces(dynamics: PhaseDynamics, count: int) -> ca.Function:
    """Return (states, torques, p) -> contact forces (2, count), share of the mass that resists the slip (1, count)."""
    state, torque = ca.SX.sym("state", dynamics.n_x), ca.SX.sym("torque", dynamics.robot.n_u)
    p = ca.SX.sym("p", len(dynamics.robot.parameters))
    shares = dynamics.robot.wellposed(dynamics.full(state)[0], p)
    inertia = shares[0 if dynamics.mode.sign > 0 else 1] if dynamics.mode.slips else ca.SX(1)
    single = ca.Function("force", [state, torque, p], [dynamics.flow(state, torque, p)[1], inertia])
    return single.map("forces", "serial", count, [2], [])


def _count_steps(transcription: Transcription, phase: Phase, x: Array) -> int:
    """Return the number of Runge-Kutta steps per interval of a phase: a power of two, so that few Functions are built.

    The steps of the longest interval are no longer than the period divided by `STEPS`.

    It is at least four, so that a force outside its cone is detected within a quarter of an interval after a node.
    """
    durations = x[transcription.variables[Unknown.DURATION][0]]
    longest, period = durations[phase.number] * phase.shares.max(), durations.sum()
    steps = STEPS * longest / period if period > 0 else 1.0
    return int(2 ** max(2, math.ceil(math.log2(max(steps, 1.0)))))


def _integrate_intervals(dynamics: PhaseDynamics, initial: Array, torque: Array, lengths: Array, p: Array) -> Array:
    """Return states and works after each Runge-Kutta step of intervals, integrated from their initial states.

    `torque` is that at the ends of all Runge-Kutta steps, `lengths` are those of the intervals [s].
    """
    count = initial.shape[1]
    parts = (torque.shape[1] - 1) // count
    integrate = _build_integrator(dynamics, parts, count)
    steps = np.repeat(lengths / parts, parts)[None]
    return np.asarray(integrate(initial, torque[:, :-1], torque[:, 1:], steps, p))


def _integrate_positive_power(
    dynamics: PhaseDynamics, initial: Array, ends: Array, torque: Array, nodes: Array, p: Array
) -> Array:
    """Return the positive work of each actuator since the start of a phase, after each Runge-Kutta step.

    Parameters
    ----------
    initial : (n_x, 1) array
        First state of the phase.
    ends : (n_x + n_works, K) array
        States and works after each step; the works start from zero in each interval.
    torque : (n_u, N + 1) array
        Torques at the nodes.
    nodes : (N + 1,) array
        Times of the nodes since the start of the phase [s].

    Returns
    -------
    (n_u, K + 1) array [J]
    """
    count, n_u = torque.shape[1] - 1, torque.shape[0]
    parts = ends.shape[1] // count
    fine, time = _subdivide(torque, parts), _subdivide(nodes[None], parts)[0]
    works = ends[dynamics.n_x : dynamics.n_x + n_u].reshape(n_u, count, parts)
    rises = np.diff(works, axis=2, prepend=0.0).reshape(n_u, -1)
    work = np.hstack([np.zeros((n_u, 1)), np.cumsum(rises, axis=1)])
    states = np.hstack([initial, ends[: dynamics.n_x]])
    power = np.asarray(_build_powers(dynamics, states.shape[1])(states, fine, p))
    absolute = np.array([integrate_absolute(time, *rows) for rows in zip(work, power, fine, strict=True)])
    return np.hstack([np.zeros((n_u, 1)), np.cumsum(absolute + rises, axis=1) / 2])


@functools.lru_cache(maxsize=64)
def _build_powers(dynamics: PhaseDynamics, count: int) -> ca.Function:
    """Return (states, torques, p) -> joint powers (n_u, count)."""
    state, torque = ca.SX.sym("state", dynamics.n_x), ca.SX.sym("torque", dynamics.robot.n_u)
    p = ca.SX.sym("p", len(dynamics.robot.parameters))
    single = ca.Function("power", [state, torque, p], [dynamics.power(state, torque, p)])
    return single.map("powers", "serial", count, [2], [])


def _subdivide(values: Array, parts: int) -> Array:
    """Return values at the ends of all Runge-Kutta steps, linear between the nodes."""
    count = values.shape[1] - 1
    at = np.linspace(0, count, parts * count + 1)
    return np.array([np.interp(at, np.arange(count + 1), row) for row in values])


@functools.lru_cache(maxsize=64)
def _build_integrator(dynamics: PhaseDynamics, steps: int, count: int) -> ca.Function:
    """Return the Function (states and works, torques, torques after, step, p) -> states and works after each step.

    `steps` Runge-Kutta steps start from each of `count` states; the torques, lengths and ends of the steps are columns
    side by side.
    """
    chain = _build_runge_kutta_step(dynamics).mapaccum("chain", steps)
    return chain if count == 1 else chain.map("follow", "serial", count, [4], [])


@functools.lru_cache(maxsize=64)
def _build_runge_kutta_step(dynamics: PhaseDynamics) -> ca.Function:
    """Return the Function (state and works, torque, torque after, step, p) -> state and works after a step, order 8."""
    state, torque = ca.SX.sym("state", dynamics.n_x + dynamics.robot.n_works), ca.SX.sym("torque", dynamics.robot.n_u)
    p = ca.SX.sym("p", len(dynamics.robot.parameters))
    rate = ca.Function("rate", [state, torque, p], ca.cse([dynamics.flow_and_energy(state, torque, p)]))
    sizes = [rate.size1_in(i) for i in (0, 1, 1, 2)]
    initial, before, after, data = (ca.MX.sym(name, size) for name, size in zip("xuvp", sizes, strict=True))
    step, change = ca.MX.sym("h"), after - before
    slopes = ca.MX(state.numel(), 0)
    for stage, (row, c) in enumerate(zip(runge_kutta.A.tolist(), runge_kutta.C.tolist(), strict=True)):
        at = initial + step * ca.mtimes(slopes, ca.DM(row[:stage])) if stage else initial
        slopes = ca.horzcat(slopes, *rate.call([at, before + c * change, data]))
    end = initial + step * ca.mtimes(slopes, ca.DM(runge_kutta.B.tolist()))
    return ca.Function("step", [initial, before, after, step, data], [end])


def read_states(transcription: Transcription, phase: Phase, x: Array) -> tuple[Array, Array]:
    """Return the reduced states and the torques at the nodes of a phase, shapes (n_x, N+1) and (n_u, N+1)."""
    layout, nodes = transcription.variables, list(phase.nodes)
    columns = [layout[Unknown.ANGLES][:, nodes], layout[Unknown.RATES][:, nodes]]
    if phase.mode.slips:
        columns.append(layout[Unknown.SLIDE, phase.number])
    return x[np.vstack(columns)], x[layout[Unknown.TORQUE][:, nodes]]


def _jump(transcription: Transcription, x: Array, p: Array, last: Segment) -> Jump:
    robot, layout = transcription.structure.robot, transcription.variables
    v_next = _first_state(transcription, x)[len(robot.angles) :]
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
