"""Motion of a decision vector at nodes and inner points, and its error between nodes."""

import functools

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred
from gaitopt.locks import cached_property
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.planar.phase_system import PhaseSystem, group_sticking
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.contact_trajectories import sample_contacts
from gaitopt.motion.ground_penetration import SampledPart
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import impact_contacts
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.multicontact.planned_impulses import read_planned_impulses
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.solution import runge_kutta
from gaitopt.ocp.statement.free_parameters import clip_values
from gaitopt.ocp.transcription.collocation import integrals, lobatto_points
from gaitopt.reductions import worst

STEPS = 4
"""Runge-Kutta steps of order 8 per interval by which a plan is integrated between its nodes."""


def plan_parameters(transcription: PlanarTranscription, problem: PlanarProblem, x: Array) -> dict[str, float]:
    """Return every parameter by name; free ones have their optimised values, limited to their bounds."""
    layout, names = transcription.variables, transcription.structure.free
    optimum = x[layout[Unknown.DESIGN][:, 0]].tolist() if names else []
    return clip_values(problem.values | dict(zip(names, optimum, strict=True)), problem.free)


@np.errstate(invalid="ignore")  # a plan that is not finite is reported by its status
def reconstruct_planar_motion(transcription: PlanarTranscription, values: dict[str, float], x: Array) -> PlanarMotion:
    """Return the planned period at nodes and inner points.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    robot = transcription.structure.robot
    p = robot.vector(values)
    segments: list[PlanarSegment] = []
    events: list[PlanarEvent] = []
    time = 0.0
    for phase in transcription.phases:
        segments.append(_segment(transcription, phase, x, values, time))
        time = float(segments[-1].time[-1])
        events.append(_event(transcription, phase, x, p, time))
    return PlanarMotion.of(robot, values, segments, events)


def sample_phase(
    transcription: PlanarTranscription, phase: GridPhase, x: Array
) -> tuple[Array, tuple[Array, Array, Array, Array]]:
    """Return the fractions of a phase and q, v, u, z at its nodes and inner points, with K columns each.

    The first rows of z are those of the equations of the phase; rows of the joints follow in the lifted form.
    """
    builder, points = transcription.builder, transcription.structure.scheme.points
    q, v, u = (x[part(phase)] for part in (builder.coordinates, builder.velocities, builder.torques))
    nodes, inner = (
        x[transcription.variables[table, phase.number]] for table in (Unknown.ACCELERATION, Unknown.INNER_ACCELERATION)
    )
    n, count, fractions = q.shape[0], phase.count, lobatto_points(points)
    h = x[transcription.variables[Unknown.DURATION][0, phase.number]] / count
    z = np.stack([nodes[:, :-1], *inner.reshape(points - 2, nodes.shape[0], count), nodes[:, 1:]])
    once, twice = integrals(points)
    rates = np.einsum("ij,jnk->ink", once, z[:, :n])
    displacements = np.einsum("ij,jnk->ink", twice, z[:, :n])
    inside = range(1, points - 1)
    columns = [
        [q[:, :-1], *[q[:, :-1] + h * (fractions[i] * v[:, :-1] + h * displacements[i]) for i in inside]],
        [v[:, :-1], *[v[:, :-1] + h * rates[i] for i in inside]],
        [u[:, :-1], *[u[:, :-1] + fractions[i] * (u[:, 1:] - u[:, :-1]) for i in inside]],
        list(z[:-1]),
    ]
    ends = (q, v, u, nodes)
    joined = [
        np.hstack([np.stack(part, axis=-1).reshape(end.shape[0], -1), end[:, -1:]])
        for part, end in zip(columns, ends, strict=True)
    ]
    at = (np.arange(count)[:, None] + fractions[:-1]).ravel() / count
    return np.append(at, 1.0), (joined[0], joined[1], joined[2], joined[3])


@dataclass(frozen=True, eq=False)
class SampledPlan:
    """A decision vector with the values of all parameters, and its samples.

    Attributes
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """

    transcription: PlanarTranscription
    values: dict[str, float]
    x: Array

    @property
    def robot(self) -> PlanarRobot:
        """Robot of the plan."""
        return self.transcription.structure.robot

    @cached_property
    def parts(self) -> tuple[SampledPart, ...]:
        """Samples of all phases at their nodes and inner points."""
        parts, begin = list[SampledPart](), 0.0
        for phase in self.transcription.phases:
            fractions, (q, v, _, _) = sample_phase(self.transcription, phase, self.x)
            duration = float(self.x[self.transcription.variables[Unknown.DURATION][0, phase.number]])
            time = begin + duration * fractions
            parts.append(SampledPart(tuple(phase.state), time, q, v, frozenset(phase.closing())))
            begin = float(time[-1])
        return tuple(parts)


def _segment(
    transcription: PlanarTranscription, phase: GridPhase, x: Array, values: dict[str, float], start: float
) -> PlanarSegment:
    """Return a phase of the plan; the works are integrals of the interpolated powers."""
    robot, n_u = transcription.structure.robot, transcription.structure.robot.n_u
    p, duration = robot.vector(values), float(x[transcription.variables[Unknown.DURATION][0, phase.number]])
    fractions, (q, v, u, z) = sample_phase(transcription, phase, x)
    size, n_z = fractions.size, phase.system.system.size1_out(0)
    finite = np.where(np.isinf(p), 1.0, p)  # no force contains an infinite coefficient of friction
    _, powers, forces = (np.array(part) for part in phase.system.outputs.map(size)(q, v, u, z[:n_z], finite))
    works = _integrate_samples(powers, transcription.structure.scheme.points, duration / phase.count)
    kinetic, potential = (np.array(part).ravel() for part in robot.energy.map(size)(q, v, p))
    state = tuple(zip(robot.contact_names, phase.state, strict=True))
    return PlanarSegment(
        state=ContactState(state),
        time=start + duration * fractions,
        q=q,
        v=v,
        torque=u,
        force=_share(phase.system, forces.reshape(2, size, -1).transpose(2, 0, 1)),
        work=works[:n_u],
        friction_work=works[n_u:-1],
        damping_work=works[-1],
        kinetic=kinetic,
        potential=potential,
        elastic=np.array(robot.force_powers.map(size)(q, v, p)[0]).ravel(),
        points=np.array(robot.figure.map(size)(q, p)).reshape(2, size, -1).transpose(0, 2, 1),
        kinematics=Deferred(lambda: sample_contacts(robot, values, q, v)),
    )


def _integrate_samples(powers: Array, points: int, h: float) -> Array:
    """Return the integrals of quantities known at nodes and inner points from the first sample, same shape."""
    count = (powers.shape[1] - 1) // (points - 1)
    columns = np.arange(count)[:, None] * (points - 1) + np.arange(points)
    parts = h * np.einsum("ij,wkj->wki", integrals(points)[0], powers[:, columns])
    before = np.cumsum(parts[:, :, -1], axis=1) - parts[:, :, -1]
    works = (before[:, :, None] + parts[:, :, :-1]).reshape(powers.shape[0], -1)
    total = parts[:, :, -1].sum(axis=1, keepdims=True)
    return np.hstack([works, total])


def _share(system: PhaseSystem, forces: Array) -> Array:
    """Return forces (n_c, 2, K) in which the contacts of a sticking body share its tangential force by f_n."""
    for members in system.sticking:
        if len(members) > 1:
            normal, tangential = forces[list(members), 1], forces[members[0], 0].copy()
            total = normal.sum(axis=0)
            forces[list(members), 0] = tangential * normal / np.where(total > 0, total, 1.0)
    return forces


def _event(transcription: PlanarTranscription, phase: GridPhase, x: Array, p: Array, time: float) -> PlanarEvent:
    """Return the event at the end of a phase of the plan, in the names of the phase."""
    robot, sequence = transcription.structure.robot, transcription.structure.sequence
    builder, names = transcription.builder, robot.contact_names
    q, v = x[builder.coordinates(phase)[:, -1]], x[builder.velocities(phase)[:, -1]]
    following = transcription.phases[0 if phase.is_last else phase.number + 1]
    after = x[builder.velocities(following)][:, 0]
    if phase.is_last and robot.mirror is not None:
        after = robot.mirror.coordinates.T @ after
    impulse, lost, outcome = np.zeros((len(names), 2)), 0.0, None
    stages = read_planned_impulses(transcription, phase, x, (q, v, after, p))
    if phase.outcome is not None:
        impulse = _impulses(transcription, phase, x, p)
        before_and_after = [float(robot.energy(q, speed, p)[0]) for speed in (v, after)]
        lost = before_and_after[0] - before_and_after[1] + sum(stage.work for stage in stages)
        outcome = sequence.outcome(robot, phase.number)
    return PlanarEvent(
        time=time,
        names=sequence.describe_event(robot, phase.number),
        before=ContactState(tuple(zip(names, phase.state, strict=True))),
        after=sequence.state_after(robot, phase.number),
        q=q,
        v_minus=v,
        v_plus=after,
        impulse=impulse,
        outcome=outcome,
        energy_lost=lost,
        actuator_impulses=stages,
    )


def _impulses(transcription: PlanarTranscription, phase: GridPhase, x: Array, p: Array) -> Array:
    """Return the impulse (Lambda_t, Lambda_n) of each contact, shape (n_c, 2)."""
    robot, outcome = transcription.structure.robot, list(phase.outcome or ())
    values = x[transcription.variables[Unknown.IMPULSE, phase.number][:, 0]]
    closed, friction = impact_contacts(phase), float(p[robot.index("friction")])
    impulse = np.zeros((len(outcome), 2))
    for k, i in enumerate(closed):
        impulse[i, 1] = values[k]
        if outcome[i].slips:
            impulse[i, 0] = -outcome[i].sign * friction * values[k]
    for k, members in enumerate(group_sticking(robot, outcome)):
        total = impulse[list(members), 1].sum()
        share = impulse[list(members), 1] / total if total > 0 else np.full(len(members), 1 / len(members))
        impulse[list(members), 0] = values[len(closed) + k] * share
    return impulse


def errors_between_nodes(transcription: PlanarTranscription, values: dict[str, float], x: Array) -> Array:
    """Return the largest difference of a state at the end of an interval from its integration, for each phase.

    Infinite where the equations of motion have no unique solution.
    """
    robot, errors = transcription.structure.robot, np.zeros(len(transcription.phases))
    p, builder = robot.vector(values), transcription.builder
    finite = np.where(np.isinf(p), 1.0, p)
    for phase in transcription.phases:
        q, v, u = (x[part(phase)] for part in (builder.coordinates, builder.velocities, builder.torques))
        y, h = np.vstack([q, v]), x[transcription.variables[Unknown.DURATION][0, phase.number]] / phase.count
        reached = y[:, :-1]
        step = build_step(phase.system).map(phase.count)
        for k in range(STEPS):
            ends = [u[:, :-1] + part / STEPS * (u[:, 1:] - u[:, :-1]) for part in (k, k + 1)]
            try:
                reached = np.array(step(reached, *ends, h / STEPS, finite))
            except RuntimeError:  # the linear system of CasADi is singular
                reached = np.full_like(reached, np.inf)
                break
        errors[phase.number] = worst(0.0, np.abs(reached - y[:, 1:]))
    return errors


@functools.lru_cache(maxsize=64)
def build_step(system: PhaseSystem) -> ca.Function:
    """Return a Runge-Kutta step (y, u before, u after, length, p) -> y, of order 8."""
    n, n_u = system.system.size1_in(0), system.system.size1_in(2)
    y, before, after = ca.MX.sym("y", 2 * n), ca.MX.sym("before", n_u), ca.MX.sym("after", n_u)
    h, p = ca.MX.sym("h"), ca.MX.sym("p", system.system.size1_in(3))
    slopes: list[ca.MX] = []
    for row, c in zip(runge_kutta.A, runge_kutta.C, strict=True):
        stage = y
        for weight, slope in zip(row, slopes, strict=False):
            if weight:
                stage = stage + float(weight) * h * slope
        matrix, right = system.system(stage[:n], stage[n:], before + float(c) * (after - before), p)
        slopes.append(ca.vertcat(stage[n:], ca.solve(matrix, right)[:n]))
    final = y + h * sum(float(weight) * slope for weight, slope in zip(runge_kutta.B, slopes, strict=True))
    return ca.Function("step", [y, before, after, h, p], [final])
