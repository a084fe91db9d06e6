"""Initial points of the solver: a guess sampled on the grid of a transcription."""

import math

import numpy as np

from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.initial_guess import Guess, Sample, Setting
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach
from gaitopt.ocp.transcription.transcription import Transcription


def setting(problem: GaitProblem) -> Setting:
    """Return the data of a guess: the requested step length and period where fixed, otherwise typical ones."""
    speed, lengths = problem.speed_range, problem.step_length_range
    length, natural = lengths.lower, speed.lower
    if lengths.lower < lengths.upper or speed.lower < speed.upper:
        reach = find_longest_reach(problem.robot, problem.values, problem.limits.angles(problem.robot.angles))
        length = _typical(lengths.lower, lengths.upper, 0.15 * reach)
        # The duration of a swing is about that of a pendulum of the leg's length.
        swing = 0.9 * math.sqrt(reach / 2 / problem.values["gravity"]) * 2
        natural = _typical(speed.lower, speed.upper, length / swing)
    return Setting(problem.robot, problem.values, problem.sequence, length, length / natural)


def _typical(lower: float, upper: float, usual: float) -> float:
    return min(max(usual, lower), upper)


def initial_point(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return the initial point of a solve, shape (n_variables,), inside the bounds of the variables."""
    limits = bounds(transcription, problem)
    return np.clip(point_from_guess(transcription, problem, guess), limits.x_lower, limits.x_upper)


def point_from_guess(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return the decision vector of a guess, not clipped to the bounds, shape (n_variables,)."""
    layout, aim = transcription.variables, setting(problem)
    durations = guess.durations(aim)
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    pieces = [ends[phase.number] + durations[phase.number] * phase.fractions for phase in transcription.phases]
    time = np.concatenate([pieces[0], *[piece[1:] for piece in pieces[1:]]])
    sample = guess.sample(aim, time)
    nodal = transcription.structure.scheme.nodal
    driven = sample if nodal else guess.sample(aim, (time[1:] + time[:-1]) / 2)
    x = np.zeros(layout.size)
    x[layout[Unknown.ANGLES]], x[layout[Unknown.RATES]] = sample.angles, sample.rates
    x[layout[Unknown.TORQUE]] = driven.torque
    x[layout[Unknown.DURATION][0]] = durations
    x[layout[Unknown.TRAVEL]] = aim.step_length
    if Unknown.SLOPE in layout:
        x[layout[Unknown.SLOPE]] = aim.values["slope"]
    if Unknown.DESIGN in layout:
        start = {**aim.values, **guess.parameters}
        x[layout[Unknown.DESIGN][:, 0]] = [start[name] for name in transcription.structure.free]
    if Unknown.PEAK in layout:
        x[layout[Unknown.PEAK]] = transcription.structure.objective.typical
    for slack in transcription.slacks:
        x[layout.find(Kind.SLACK, slack.name)] = slack.start
    data = data_vector(problem)
    if nodal:
        _fill_slides(transcription, x, sample)
        _fill_accelerations(transcription, x, data)
    else:
        _fill_contact(transcription, x, sample)
    _fill_powers(transcription, x, driven, data)
    return x


def _fill_slides(transcription: Transcription, x: Array, sample: Sample) -> None:
    """Set slide and speed of the foot in slip phases."""
    for phase in transcription.phases:
        if phase.mode.slips:
            nodes = list(phase.nodes)
            slide, speed = transcription.variables[Unknown.SLIDE, phase.number]
            x[slide], x[speed] = sample.slide[nodes] - sample.slide[nodes[0]], sample.slide_rate[nodes]


def _fill_contact(transcription: Transcription, x: Array, sample: Sample) -> None:
    """Set slide and speed of the foot along a step with open phases, and a normal force equal to the weight."""
    layout = transcription.variables
    x[layout[Unknown.SLIDE]] = sample.slide - sample.slide[0], sample.slide_rate
    x[layout.find(Kind.CONTACT_NORMAL)] = 1.0
    for phase in transcription.phases:
        slip = layout[Unknown.CONTACT, phase.number][-1]
        x[slip] = np.abs(sample.slide_rate[list(phase.nodes)[1:]])


def _fill_accelerations(transcription: Transcription, x: Array, data: Array) -> None:
    """Set the accelerations of a scheme, if it has any, by forward dynamics of the guessed states and torques."""
    layout, inner = transcription.variables, np.array(transcription.structure.scheme.inner)
    for phase, dynamics in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        if (Unknown.ACCELERATION, phase.number) not in layout:
            continue
        nodes = list(phase.nodes)
        parts = [x[layout[table][:, nodes]] for table in (Unknown.ANGLES, Unknown.RATES)]
        states = np.vstack(parts + ([x[layout[Unknown.SLIDE, phase.number]]] if phase.mode.slips else []))
        torques, p = x[layout[Unknown.TORQUE][:, nodes]], data[: len(transcription.structure.robot.parameters)]
        forward = dynamics.sample_accelerations(states, torques, p)
        moving = np.nan_to_num(forward)  # the solver reports a singular mass matrix
        x[layout[Unknown.ACCELERATION, phase.number]] = moving
        x[layout[Unknown.INNER_ACCELERATION, phase.number]] = _inside(moving, inner)


def _inside(values: Array, inner: Array) -> Array:
    """Return values at nodes, shape (n, N + 1), interpolated at inner points, shape (n_inner n, N)."""
    left, right = values[:, :-1], values[:, 1:]
    return np.vstack([left + fraction * (right - left) for fraction in inner])


def _fill_powers(transcription: Transcription, x: Array, driven: Sample, data: Array) -> None:
    """Set impulse, power parts and integral to values consistent with the guessed motion.

    `driven` is the guess at the instants of the torque unknowns.
    """
    structure, layout = transcription.structure, transcription.variables
    robot, p = structure.robot, data[: len(structure.robot.parameters)]
    names = [parameter.name for parameter in robot.parameters]
    mass = float(FastCall(robot.mass)(p)[0][0])
    weight = mass * p[names.index("gravity")]
    # With open phases the impulse is the momentum at about 1 m/s.
    x[layout[Unknown.IMPULSE][1]] = 0.1 * weight if structure.scheme.nodal else mass
    if not structure.objective.uses_power:
        return
    count = driven.torque.shape[1]
    q, v = full_coordinates(driven.angles), full_coordinates(driven.rates)
    rates = np.asarray(robot.joint_rates.map(count)(q, v, np.tile(p[:, None], count)))
    power = (driven.torque * rates)[[robot.actuators.index(name) for name in structure.powered]]
    parts = np.vstack([np.maximum(power, 0), np.maximum(-power, 0)])
    if structure.scheme.nodal:
        x[layout[Unknown.POWER]] = parts
    for phase in transcription.phases:
        inside = parts[:, list(phase.nodes)[: None if structure.scheme.nodal else -1]]
        if structure.scheme.nodal:
            inside = _inside(inside, structure.scheme.power_fractions[1:-1])
        x[layout[Unknown.INNER_POWER, phase.number]] = inside
    if structure.objective.per_weight_and_travel:
        x[layout[Unknown.INTEGRAL]] = 0.02 * weight * x[layout[Unknown.TRAVEL]]
