"""Contact sequences with open phases: the phases that a relaxed time-stepping programme proposes."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from attrs import evolve

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import Bounds, bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import setting
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution, select_admitted, select_simplest
from gaitopt.ocp.mode_search.complementarity_residual import complementarity_residual
from gaitopt.ocp.mode_search.homotopy import Homotopy, follow_homotopy
from gaitopt.ocp.mode_search.impact_proposal import impact_residual, impulse_and_speed, outcomes_near
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.initial_guess import Guess, Sample
from gaitopt.ocp.transcription.phase_complementarity import CONTACT, transcribe_open
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.progress import SolveObserver

AGREEMENT = 0.1
"""Largest relative difference in cost of the closed contact sequence; the grids differ, and one is of low order."""

MOST_SEQUENCES = 3
"""Proposed contact sequences that are solved."""

BRIEF = 2
"""A run of equal modes with fewer intervals may be an artefact of the grid."""


def propose_phases(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, homotopy: Homotopy
) -> Candidates:
    """Follow the homotopy of a contact sequence with open phases on a grid of its own."""
    parts = {Mode.ANY: 1, Mode.STICK: 2}
    counts = tuple(homotopy.intervals // parts.get(mode, 4) for mode in problem.sequence.phases)
    method = evolve(problem.transcription, intervals=counts)
    transcription = transcribe_open(replace(structure(problem, method, homotopy.relaxation), rate_limited=False))
    limits = open_bounds(transcription, problem)
    trail = follow_homotopy(
        homotopy,
        transcription,
        np.clip(open_start(transcription, problem, guess), limits.x_lower, limits.x_upper),
        data_vector(problem),
        limits,
        lambda x: max(impact_residual(transcription, problem, x), friction_residual(transcription, problem, x)),
        solver,
        observer,
    )
    x = np.nan_to_num(trail.outcome.x)
    impacts = [problem.sequence.impact]
    if problem.sequence.impact is Mode.ANY:
        impacts = outcomes_near(*impulse_and_speed(transcription, problem, x), problem)
    found = propose_sequence(transcription, problem, x, impacts)
    return Candidates(
        trail=trail,
        sequences=tuple(found),
        guesses=tuple(found.values()),
        agreement=AGREEMENT,
        biactive=len(impacts) > 1,
        on_edge=on_edge(transcription, problem, x),
    )


def relative_lengths(transcription: Transcription, x: Array) -> Array:
    """Return the length of every interval, shape (N,) [s]."""
    counts = transcription.structure.counts
    return np.repeat(x[transcription.variables["duration"][0]] / counts, counts)


def friction_residual(transcription: Transcription, problem: GaitProblem, x: Array) -> float:
    """Return the complementarity residual of friction in a solution, forces per weight, speeds in m/s."""
    layout = transcription.variables
    normal, forward, backward, _ = x[layout[CONTACT]]
    return complementarity_residual(forward - backward, normal, x[layout["slide 0"][1, 1:]], problem.friction)


def on_edge(transcription: Transcription, problem: GaitProblem, x: Array) -> int:
    """Return in how many intervals of open phases the foot sticks with its force on the cone, within the margins."""
    layout, sequence = transcription.variables, problem.sequence
    normal, forward, backward, _ = x[layout[CONTACT]]
    left_open = np.repeat([mode is Mode.ANY for mode in sequence.phases], transcription.structure.counts)
    sticks = np.abs(x[layout["slide 0"][1, 1:]]) <= problem.margins.slip_speed / 10
    inside = 1 - np.abs(forward - backward) / (problem.friction * normal)
    return int(np.sum(left_open & sticks & (inside <= 2 * problem.margins.cone)))


def open_bounds(transcription: Transcription, problem: GaitProblem) -> Bounds:
    """Return the bounds of a problem, its closed phases and impact held to their modes."""
    found, layout, sequence = bounds(transcription, problem), transcription.variables, problem.sequence
    slide, speed = layout["slide 0"]
    lower, upper = found.x_lower, found.x_upper
    lower[slide[0]] = upper[slide[0]] = 0.0
    lower[layout[CONTACT]] = 0.0
    lower[layout[CONTACT][0]] = problem.margins.normal_force
    held = [(sequence.impact, speed[:1])]
    ends = itertools.accumulate(transcription.structure.counts)
    for mode, end, count in zip(sequence.phases, ends, transcription.structure.counts, strict=True):
        held.append((mode, speed[end - count : end + 1]))
    for mode, places in held:
        if mode is Mode.STICK:
            lower[places] = upper[places] = 0.0
        elif mode is not Mode.ANY:
            lower[places] = np.maximum(lower[places], 0.0) if mode.sign > 0 else lower[places]
            upper[places] = np.minimum(upper[places], 0.0) if mode.sign < 0 else upper[places]
    return found


def open_start(transcription: Transcription, problem: GaitProblem, guess: Guess) -> Array:
    """Return the starting point of a relaxed solve, shape (n_variables,)."""
    layout, aim = transcription.variables, setting(problem)
    robot, objective = transcription.structure.robot, transcription.structure.objective
    x = np.zeros(layout.size)
    x[layout["duration"][0]] = guess.durations(aim)
    time = np.concatenate([[0.0], np.cumsum(relative_lengths(transcription, x))])
    nodes, middles = guess.sample(aim, time), guess.sample(aim, (time[1:] + time[:-1]) / 2)
    x[layout["angles"]], x[layout["rates"]] = nodes.angles, nodes.rates
    x[layout["slide 0"]] = nodes.slide - nodes.slide[0], nodes.slide_rate
    x[layout["torque"]] = middles.torque
    x[layout[CONTACT][0]], x[layout[CONTACT][3]] = 1.0, np.abs(nodes.slide_rate[1:])
    x[layout["travel"]] = aim.step
    p = robot.vector(problem.values)
    mass = float(robot.mass(p))
    x[layout["impulse"][1]] = mass  # the momentum of a walk at about 1 m/s
    if "slope" in layout:
        x[layout["slope"]] = aim.values["slope"]
    if objective.uses_power:
        q, v = (np.vstack([np.zeros((2, middles.slide.size)), part]) for part in (middles.angles, middles.rates))
        rates = np.array([np.asarray(robot.joint_rates(q[:, k], v[:, k], p)).ravel() for k in range(q.shape[1])]).T
        power = (middles.torque * rates)[[robot.actuators.index(name) for name in transcription.structure.powered]]
        x[layout["power"]] = np.vstack([np.maximum(power, 0), np.maximum(-power, 0)])
    if "integral" in layout:
        x[layout["integral"]] = 0.02 * mass * problem.values["gravity"] * aim.step
    return x


@dataclass(frozen=True)
class ModeRun:
    """Neighbouring intervals in one contact mode.

    Attributes
    ----------
    mode : Mode
    first, count : int
    """

    mode: Mode
    first: int
    count: int


def runs_of(speed: Array, margin: float) -> list[ModeRun]:
    """Return the runs of equal contact modes of a foot with given speeds at the nodes, shape (N+1,) [m/s].

    A slide that never exceeds `margin`, the least speed of a sliding foot, is none.
    """
    middle = (speed[1:] + speed[:-1]) / 2
    modes = [Mode.slipping(v) if abs(v) > margin / 10 else Mode.STICK for v in middle]
    for run in _grouped(modes):
        own = speed[run.first : run.first + run.count + 1]
        if run.mode.slips and np.max(np.abs(own)) < margin:
            modes[run.first : run.first + run.count] = [Mode.STICK] * run.count
    return _grouped(modes)


def without_brief(runs: list[ModeRun], kept: Mode) -> list[ModeRun]:
    """Return runs without those of fewer than `BRIEF` intervals, which join the run before, or else after.

    The first one stays if it has the mode `kept`: what an impact leaves sliding slides on, however briefly.
    """
    modes: list[Mode | None] = []
    for i, run in enumerate(runs):
        brief = run.count < BRIEF and not (i == 0 and run.mode is kept)
        modes += [(modes[-1] if modes else None) if brief else run.mode] * run.count
    known = next((mode for mode in modes if mode is not None), Mode.STICK)
    return _grouped([mode or known for mode in modes])


def _grouped(modes: list[Mode]) -> list[ModeRun]:
    runs, first = [], 0
    for mode, group in itertools.groupby(modes):
        count = len(list(group))
        runs.append(ModeRun(mode, first, count))
        first += count
    return runs


def propose_sequence(
    transcription: Transcription, problem: GaitProblem, x: Array, impacts: list[Mode]
) -> dict[ContactSequence, RelaxedSolution]:
    """Return the sequences that a relaxed solution stands for, likeliest first, and the starts of their solves."""
    runs = runs_of(x[transcription.variables["slide 0"][1]], problem.margins.slip_speed)
    choices: dict[ContactSequence, list[ModeRun]] = {}
    for impact in impacts:
        for choice in (without_brief(runs, impact), runs):
            if impact.slips and choice[0].mode is not impact:
                choice = [ModeRun(impact, 0, 1), *_shortened(choice)]
            for sequence in select_admitted(
                [ContactSequence(tuple(run.mode for run in choice), impact)], problem.sequence
            ):
                choices.setdefault(sequence, choice)
    if not choices:  # the relaxed problem has not been solved
        sequence, count = (
            select_simplest(problem.sequence),
            sum(transcription.structure.counts) // len(select_simplest(problem.sequence).phases),
        )
        choices[sequence] = [ModeRun(mode, i * count, count) for i, mode in enumerate(sequence.phases)]
    return {
        sequence: _start_of(transcription, problem, x, choices[sequence]) for sequence in list(choices)[:MOST_SEQUENCES]
    }


def _shortened(runs: list[ModeRun]) -> list[ModeRun]:
    """Return runs without the first interval."""
    first, *others = runs
    return others if first.count == 1 else [ModeRun(first.mode, first.first + 1, first.count - 1), *others]


def _start_of(transcription: Transcription, problem: GaitProblem, x: Array, runs: list[ModeRun]) -> RelaxedSolution:
    layout, steps = transcription.variables, relative_lengths(transcription, x)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    middles = (time[1:] + time[:-1]) / 2
    torque = np.array([np.interp(time, middles, row) for row in x[layout["torque"]]])
    slide, speed = x[layout["slide 0"]]
    return RelaxedSolution(
        durations_found=np.array([steps[run.first : run.first + run.count].sum() for run in runs]),
        time=time,
        found=Sample(x[layout["angles"]], x[layout["rates"]], torque, slide, speed),
        solution=None,
        label=f"what was found for '{problem.sequence}'",
    )
