"""Starting points: a guess laid on the grid of a transcription."""

import math

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.initial_guess import Guess, Setting
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach
from gaitopt.ocp.transcription.transcription import Transcription


def setting(problem: GaitProblem) -> Setting:
    """Return the step and period a guess should aim at."""
    reach = find_longest_reach(problem.robot, problem.values, problem.limits.angles(problem.robot.angles))
    speed, step = problem.speed_range, problem.step_range
    length = _typical(step.lower, step.upper, 0.15 * reach)
    # A swing leg falls forward in about the time of a pendulum of its length.
    natural = _typical(speed.lower, speed.upper, length / (0.9 * math.sqrt(reach / 2 / problem.values["gravity"]) * 2))
    return Setting(problem.robot, problem.values, problem.sequence, length, length / natural)


def _typical(lower: float, upper: float, usual: float) -> float:
    return min(max(usual, lower), upper)


def initial_point(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return the starting point of a solve, shape (n_variables,), inside the bounds of the variables."""
    limits = bounds(transcription, problem)
    return np.clip(point_from_guess(transcription, problem, guess), limits.x_lower, limits.x_upper)


def point_from_guess(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return a guess as it is, shape (n_variables,)."""
    layout, aim = transcription.variables, setting(problem)
    durations = guess.durations(aim)
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    pieces = [
        np.linspace(ends[phase.number], ends[phase.number + 1], phase.count + 1) for phase in transcription.phases
    ]
    time = np.concatenate([pieces[0], *[piece[1:] for piece in pieces[1:]]])
    sample = guess.sample(aim, time)
    x = np.zeros(layout.size)
    x[layout["angles"]], x[layout["rates"]], x[layout["torque"]] = sample.angles, sample.rates, sample.torque
    x[layout["duration"][0]] = durations
    x[layout["travel"]] = aim.step
    for phase in transcription.phases:
        if phase.mode.slips:
            own = list(phase.nodes)
            slide, speed = layout[f"slide {phase.number}"]
            x[slide], x[speed] = sample.slide[own] - sample.slide[own[0]], sample.slide_rate[own]
    if "slope" in layout:
        x[layout["slope"]] = aim.values["slope"]
    data = data_vector(problem)
    _fill_accelerations(transcription, x, data)
    _fill_powers(transcription, x, data)
    return x


def _fill_accelerations(transcription: Transcription, x: Array, data: Array) -> None:
    """Set accelerations, where a scheme has them, to those the guessed states and torques have."""
    layout, inner = transcription.variables, np.array(transcription.structure.scheme.inner)
    robot = transcription.structure.robot
    for phase in transcription.phases:
        if f"acceleration {phase.number}" not in layout:
            continue
        nodes = list(phase.nodes)
        q, v = np.zeros((2, robot.n_q, len(nodes)))
        q[2:], v[2:] = x[layout["angles"][:, nodes]], x[layout["rates"][:, nodes]]
        if phase.mode.slips:
            q[0], v[0] = x[layout[f"slide {phase.number}"]]
        p = np.tile(data[: len(robot.parameters), None], len(nodes))
        found = robot.acceleration[phase.mode].map(len(nodes))(q, v, x[layout["torque"][:, nodes]], p)[0]
        of_all = np.nan_to_num(np.asarray(found))  # a singular robot is the solver's to report
        moving = np.vstack([of_all[2:], of_all[: phase.mode.slips]])
        x[layout[f"acceleration {phase.number}"]] = moving
        x[layout[f"inner acceleration {phase.number}"]] = _inside(moving, inner)


def _inside(values: Array, inner: Array) -> Array:
    """Return values at nodes, shape (n, N + 1), interpolated at inner points, shape (n_inner n, N)."""
    left, right = values[:, :-1], values[:, 1:]
    return np.vstack([left + fraction * (right - left) for fraction in inner])


def _fill_powers(transcription: Transcription, x: Array, data: Array) -> None:
    """Set impulse, power parts and integral to values that fit the guessed motion."""
    robot, layout = transcription.structure.robot, transcription.variables
    p = data[: len(robot.parameters)]
    weight = (
        float(robot.mass(p)) * dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))["gravity"]
    )
    x[layout["impulse"][1]] = 0.1 * weight
    if not transcription.structure.objective.uses_power:
        return
    q = np.vstack([np.zeros((2, transcription.n_nodes)), x[layout["angles"]]])
    v = np.vstack([np.zeros((2, transcription.n_nodes)), x[layout["rates"]]])
    rates = np.asarray(robot.joint_rates.map(transcription.n_nodes)(q, v, np.tile(p[:, None], transcription.n_nodes)))
    powered = [robot.actuators.index(name) for name in transcription.structure.powered]
    power = (x[layout["torque"]] * rates)[powered]
    parts = np.vstack([np.maximum(power, 0), np.maximum(-power, 0)])
    x[layout["power"]] = parts
    for phase in transcription.phases:
        own = _inside(parts[:, list(phase.nodes)], np.array(transcription.structure.scheme.inner))
        x[layout[f"inner power {phase.number}"]] = own
    if transcription.structure.objective.per_weight_and_travel:
        x[layout["integral"]] = 0.02 * weight * x[layout["travel"]]
