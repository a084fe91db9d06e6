"""Initial point of the NLP of a planar robot, from a guess or from an earlier solution."""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.ocp.nlp.keys import Key, Unknown, table_name
from gaitopt.ocp.planar.phase_grid import GridPhase
from gaitopt.ocp.planar.planar_guess import TYPICAL_SPEED, PlanarSetting
from gaitopt.ocp.planar.planar_problem import PlanarProblem
from gaitopt.ocp.planar.planar_transcription import PlanarTranscription

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


def planar_start(transcription: PlanarTranscription, problem: PlanarProblem) -> Array:
    """Return the initial point from the guess of a problem: its motion, no torques, and the weight on the contacts."""
    layout, setting, guess = transcription.variables, setting_of(problem), problem.guess
    x = np.zeros(layout.size)
    durations = guess.durations(setting)
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    times = [np.linspace(ends[i], ends[i + 1], phase.count + 1) for i, phase in enumerate(transcription.phases)]
    builder = transcription.builder
    for phase, time in zip(transcription.phases, times, strict=True):
        q, v = guess.sample(setting, time)
        x[builder.coordinates(phase)], x[builder.velocities(phase)] = q, v
        _set_forces(transcription, phase, problem, x)
    if problem.robot.travel is not None:
        row = layout[Unknown.COORDINATES][problem.robot.coordinates.index(problem.robot.travel)]
        x[row] -= x[row[0]]
    x[layout[Unknown.DURATION][0]] = durations
    return x


def _set_forces(transcription: PlanarTranscription, phase: GridPhase, problem: PlanarProblem, x: Array) -> None:
    """Share the weight between the feet on the ground."""
    layout, robot, closed = transcription.variables, problem.robot, phase.system.closed
    feet = [k for k, i in enumerate(closed) if robot.contacts[i].kind != "stop"]
    weight = float(robot.mass(robot.vector(problem.values))) * problem.values["gravity"]
    nodes, inner = (layout[table, phase.number] for table in (Unknown.ACCELERATION, Unknown.INNER_ACCELERATION))
    for k in feet:
        entry = robot.n_q + k
        x[nodes[entry]] = x[inner[entry :: nodes.shape[0]]] = weight / len(feet)
        mode = phase.state[closed[k]]
        if phase.outcome is not None and mode is not Mode.FREE:
            x[layout[Unknown.IMPULSE, phase.number]] = 0.0


def solution_of(transcription: PlanarTranscription, x: Array, multipliers: tuple[Array, Array], g: Array) -> Solution:
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
