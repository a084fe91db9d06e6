"""Initial point of the NLP of a planar robot, from a guess or from an earlier solution."""

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_bounds import planar_data, weight_of
from gaitopt.ocp.multicontact.planar_guess import TYPICAL_SPEED, PlanarSample, PlanarSetting
from gaitopt.ocp.multicontact.planar_point import count_solution
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.multicontact.planned_impulses import set_impulse_start
from gaitopt.ocp.nlp.keys import Key, Unknown, table_name
from gaitopt.ocp.statement.free_parameters import fix_free_parameters

TYPICAL_STEP = 0.4
"""Step length [m] of the guess if it is free."""


def setting_of(problem: PlanarProblem) -> PlanarSetting:
    """Return the data of a problem for its guess."""
    step, speed = (
        TYPICAL_STEP
        if problem.step_length is None
        else _middle(problem.step_length_range.lower, problem.step_length_range.upper),
        TYPICAL_SPEED if problem.speed is None else _middle(problem.speed_range.lower, problem.speed_range.upper),
    )
    return PlanarSetting(
        robot=problem.robot,
        values=problem.values,
        sequence=problem.sequence,
        bounds=np.array(problem.limits.coordinates(problem.robot.coordinates)),
        step_length=step,
        period=step / speed,
    )


def _middle(lower: float, upper: float) -> float:
    return (lower + upper) / 2 if np.isfinite(upper) else lower


def planar_start(transcription: PlanarTranscription, problem: PlanarProblem, durations: Array | None = None) -> Array:
    """Return the initial point from the guess of a problem.

    Parameters
    ----------
    transcription : PlanarTranscription
    problem : PlanarProblem
    durations : (n_phases,) array, optional
        Durations of the phases [s], over which the guess is stretched.
    """
    if problem.free:
        problem = set_start_parameters(problem)
    layout, setting, builder = transcription.variables, setting_of(problem), transcription.builder
    x, guessed = np.zeros(layout.size), problem.guess.durations(setting)
    durations = guessed if durations is None else durations
    starts = np.cumsum(guessed) - guessed
    for phase in transcription.phases:
        i = phase.number
        for inner, fraction in enumerate(transcription.structure.scheme.fractions[:-1]):
            count = phase.count + (inner == 0)
            time = starts[i] + guessed[i] * np.minimum((np.arange(count) + fraction) / phase.count, 1)
            sample = problem.guess.sample(setting, time, i)
            if inner == 0:
                x[builder.coordinates(phase)] = sample.q
                x[builder.velocities(phase)] = sample.v * guessed[i] / durations[i]
                if sample.torque is not None:
                    x[builder.torques(phase)] = sample.torque
            _set_accelerations(transcription, phase, problem, sample, (inner, x))
    if problem.robot.travel is not None:
        row = layout[Unknown.COORDINATES][problem.robot.coordinates.index(problem.robot.travel)]
        x[row] -= x[row[0]]
    x[layout[Unknown.DURATION][0]] = durations
    set_impulse_start(transcription, x, problem.guess.events)
    if Unknown.PEAK in layout:
        x[layout[Unknown.PEAK]] = problem.objective.typical
    if problem.free:
        x[layout[Unknown.DESIGN][:, 0]] = [problem.values[name] for name in problem.free]
    return x


def set_start_parameters(problem: PlanarProblem) -> PlanarProblem:
    """Return the problem; its free parameters have the values of its guess, if the guess contains any."""
    known = {name: value for name, value in problem.guess.parameters.items() if name in problem.free}
    return problem.replace(**fix_free_parameters(known, problem.parameters, {}) | {"free": problem.free})


def _set_accelerations(
    transcription: PlanarTranscription,
    phase: GridPhase,
    problem: PlanarProblem,
    sample: PlanarSample,
    target: tuple[int, Array],
) -> None:
    """Set accelerations and forces of the nodes, or of an inner point: of the motion, or the weight on the feet."""
    layout, robot, closed, (inner, x) = transcription.variables, problem.robot, phase.system.closed, target
    nodes, between = (layout[table, phase.number] for table in (Unknown.ACCELERATION, Unknown.INNER_ACCELERATION))
    size, n_z = nodes.shape[0], count_solution(phase)
    place = nodes if inner == 0 else between[(inner - 1) * size : inner * size]
    p = planar_data(problem)[: len(robot.parameters)]
    if sample.torque is not None:
        for k in range(place.shape[1]):
            matrix, right = (
                np.array(part) for part in phase.system.system(sample.q[:, k], sample.v[:, k], sample.torque[:, k], p)
            )
            x[place[:n_z, k]] = np.linalg.lstsq(matrix, right.ravel(), rcond=1e-12)[0]
    else:
        feet = [k for k, i in enumerate(closed) if robot.contacts[i].kind != "stop"]
        for k in feet:
            x[place[robot.n_q + k]] = weight_of(robot, problem.values) / len(feet)
    x[place[n_z:]] = _find_joint_values(transcription, phase, sample, x[place[:n_z]], p)


def _find_joint_values(
    transcription: PlanarTranscription, phase: GridPhase, sample: PlanarSample, z: Array, p: Array
) -> Array:
    """Return accelerations and forces of the joints for given accelerations and contact forces, shape (2 n_j, K).

    Each depends on those nearer to the base or to the end of a leg, so that repeated evaluation ends at their values.
    """
    equations, (n, count) = transcription.structure.equations, sample.q.shape
    joints = np.zeros((2 * equations.n_j, count))
    if equations.n_j:
        u = np.zeros((transcription.structure.robot.n_u, count)) if sample.torque is None else sample.torque
        forces = np.array(phase.system.outputs.map(count)(sample.q, sample.v, u, z, p)[2])
        motion = equations.motion.map(count)
        for _ in range(joints.shape[0]):
            joints += np.array(motion(sample.q, sample.v, u, z[:n], forces, joints, p)[0])[n:]
    return joints


def tabulate_solution(
    transcription: PlanarTranscription, x: Array, multipliers: tuple[Array, Array], g: Array
) -> Solution:
    """Return a point of an NLP as named tables."""
    return Solution(
        intervals=transcription.structure.counts,
        unknowns={
            table_name(name): _table(transcription.variables.rows[name], x[index], multipliers[0][index])
            for name, index in transcription.variables.tables.items()
        },
        constraints={
            table_name(name): _table(transcription.constraints.rows[name], g[index], multipliers[1][index])
            for name, index in transcription.constraints.tables.items()
        },
    )


def _table(rows: tuple[Key, ...], values: Array, multipliers: Array) -> Table:
    return Table(tuple(key.label for key in rows), values, multipliers, tuple(key.identifier for key in rows))
