"""Numbers of a solve: bounds, data and starting point of a transcription for one problem."""

import math
from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.grid import Phase
from gaitopt.ocp.guess import Guess, Setting
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.reach import longest_reach
from gaitopt.ocp.shooting import MARGINS, Transcription


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of variables and constraint rows.

    Attributes
    ----------
    x_lower, x_upper : (n_variables,) arrays
    g_lower, g_upper : (n_constraints,) arrays
    """

    x_lower: Array
    x_upper: Array
    g_lower: Array
    g_upper: Array


def data_vector(problem: GaitProblem) -> Array:
    """Return the data of a solve: robot parameters, then the margins that enter constraints."""
    margins = [getattr(problem.margins, name) for name in MARGINS]
    return np.concatenate([problem.robot.vector(problem.values), margins])


def bounds(transcription: Transcription, problem: GaitProblem) -> Bounds:
    """Return the bounds of a problem."""
    layout, limits = transcription.variables, problem.limits
    lower, upper = np.full(layout.size, -math.inf), np.full(layout.size, math.inf)
    torque = np.array(limits.torques(problem.robot.actuators))[:, None]
    symmetric: dict[str, float | Array] = {"angles": limits.angle, "rates": limits.rate, "torque": torque}
    for name, size in symmetric.items():
        lower[layout[name]], upper[layout[name]] = -size, size
    lower[layout["duration"]], upper[layout["duration"]] = limits.shortest_phase, limits.longest_step
    lower[layout["impulse"][1]] = 0.0
    step = problem.step_range
    lower[layout["travel"]], upper[layout["travel"]] = max(step.lower, 1e-3), step.upper
    for name in layout.tables:
        if "power" in name:
            lower[layout[name]] = 0.0
    for phase in transcription.phases:
        if phase.mode.slips:
            slide, speed = layout[f"slide {phase.number}"]
            lower[slide[0]] = upper[slide[0]] = 0.0
            low, high = _speed_bounds(phase, problem.margins.slip_speed)
            lower[speed], upper[speed] = low, high

    g_lower, g_upper = transcription.row_bounds.copy()
    rows = {
        "speed": (problem.speed_range.lower, problem.speed_range.upper),
        "step duration": (0.0, limits.longest_step),
        "separation of the trailing foot": (problem.margins.separation, math.inf),
    }
    for index, (_, name) in enumerate(transcription.constraints.labels):
        if name in rows:
            g_lower[index], g_upper[index] = rows[name]
        elif name.startswith("normal force"):
            g_lower[index] = problem.margins.normal_force
    return Bounds(lower, upper, g_lower, g_upper)


def _speed_bounds(phase: Phase, margin: float) -> tuple[Array, Array]:
    """Return bounds of the foot speed at the phase's nodes, fading to zero towards an end at rest."""
    part = np.linspace(0, 1, phase.count + 1)
    least = np.full(part.size, margin)
    if phase.starts_at_rest:
        least *= np.minimum(1, 2 * part) ** 2  # a slide that starts on the cone starts with zero acceleration
    if phase.ends_at_rest:
        least *= np.minimum(1, 2 * (1 - part))
    most = np.full(part.size, math.inf)
    most[0] = 0.0 if phase.starts_at_rest else math.inf
    most[-1] = 0.0 if phase.ends_at_rest else math.inf
    return (least, most) if phase.mode.sign > 0 else (-most, -least)


def setting(problem: GaitProblem) -> Setting:
    """Return the step and period a guess should aim at."""
    reach = longest_reach(problem.robot, problem.values, problem.limits.angle)
    speed, step = problem.speed_range, problem.step_range
    length = _typical(step.lower, step.upper, 0.15 * reach)
    # A swing leg falls forward in about the time of a pendulum of its length.
    natural = _typical(speed.lower, speed.upper, length / (0.9 * math.sqrt(reach / 2 / problem.values["gravity"]) * 2))
    return Setting(problem.robot, problem.values, problem.word, length, length / natural)


def _typical(lower: float, upper: float, usual: float) -> float:
    return min(max(usual, lower), upper)


def start(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return the starting point of a solve, shape (n_variables,), inside the bounds of the variables."""
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
    _fill_powers(transcription, x, data_vector(problem))
    limits = bounds(transcription, problem)
    return np.clip(x, limits.x_lower, limits.x_upper)


def _fill_powers(transcription: Transcription, x: Array, data: Array) -> None:
    """Set impulse, power parts and integral to values that fit the guessed motion."""
    robot, layout = transcription.robot, transcription.variables
    p = data[: len(robot.parameters)]
    weight = (
        float(robot.momentum(np.zeros(robot.n_q), np.zeros(robot.n_q), p)[2])
        * dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))["gravity"]
    )
    x[layout["impulse"][1]] = 0.1 * weight
    if not transcription.objective.uses_power:
        return
    q = np.vstack([np.zeros((2, transcription.n_nodes)), x[layout["angles"]]])
    v = np.vstack([np.zeros((2, transcription.n_nodes)), x[layout["rates"]]])
    rates = np.asarray(robot.joint_rates.map(transcription.n_nodes)(q, v, np.tile(p[:, None], transcription.n_nodes)))
    power = x[layout["torque"]] * rates
    parts = np.vstack([np.maximum(power, 0), np.maximum(-power, 0)])
    x[layout["power"]] = parts
    for phase in transcription.phases:
        own = parts[:, list(phase.nodes)]
        x[layout[f"mid power {phase.number}"]] = (own[:, :-1] + own[:, 1:]) / 2
    if transcription.objective.per_weight_and_travel:
        x[layout["integral"]] = 0.02 * weight * x[layout["travel"]]
