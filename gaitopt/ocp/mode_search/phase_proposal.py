"""Contact sequences with open phases: the phases that a relaxed time-stepping NLP proposes."""

import itertools
from dataclasses import dataclass

import numpy as np
from attrs import evolve

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution, select_admitted, select_simplest
from gaitopt.ocp.mode_search.complementarity_residual import complementarity_residual
from gaitopt.ocp.mode_search.homotopy import Homotopy, follow_homotopy
from gaitopt.ocp.mode_search.impact_proposal import impact_residual, impulse_and_speed, outcomes_near
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.initial_guess import Guess, Sample
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import SolveObserver
from gaitopt.reductions import worst

AGREEMENT = 0.1
"""Largest relative difference in cost of the closed contact sequence; the grids differ, and one is of low order."""

MOST_SEQUENCES = 3
"""Proposed contact sequences that are solved."""

BRIEF = 2
"""A run of equal modes with fewer intervals may be an artefact of the grid."""


def propose_phases(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, homotopy: Homotopy
) -> Candidates:
    """Follow the homotopy of a contact sequence with open phases on a separate grid."""
    parts = {Mode.ANY: 1, Mode.STICK: 2}
    counts = tuple(homotopy.intervals // parts.get(mode, 4) for mode in problem.sequence.phases)
    method = evolve(problem.transcription, intervals=counts)
    transcription = transcribe(structure(problem, method, homotopy.relaxation))
    trail = follow_homotopy(
        homotopy,
        transcription,
        initial_point(transcription, problem, guess),
        data_vector(problem),
        bounds(transcription, problem),
        lambda x: worst(impact_residual(transcription, problem, x), friction_residual(transcription, problem, x)),
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
    return np.repeat(x[transcription.variables[Unknown.DURATION][0]] / counts, counts)


def contact(transcription: Transcription, x: Array) -> Array:
    """Return normal force, forward and backward friction per weight, and slip speed, shape (4, N)."""
    return np.hstack([x[transcription.variables[Unknown.CONTACT, phase.number]] for phase in transcription.phases])


def friction_residual(transcription: Transcription, problem: GaitProblem, x: Array) -> float:
    """Return the complementarity residual of friction in a solution, forces per weight, speeds in m/s."""
    normal, forward, backward, _ = contact(transcription, x)
    return complementarity_residual(
        forward - backward, normal, x[transcription.variables[Unknown.SLIDE][1, 1:]], problem.friction
    )


def on_edge(transcription: Transcription, problem: GaitProblem, x: Array) -> int:
    """Return in how many intervals of open phases the foot sticks with its force on the cone, within the margins."""
    normal, forward, backward, _ = contact(transcription, x)
    is_open = np.repeat([mode is Mode.ANY for mode in problem.sequence.phases], transcription.structure.counts)
    speed = x[transcription.variables[Unknown.SLIDE][1, 1:]]
    sticks = np.abs(speed) <= problem.margins.slip_speed / 10
    inside = 1 - np.abs(forward - backward) / (problem.friction * normal)
    return int(np.sum(is_open & sticks & (inside <= 2 * problem.margins.cone)))


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

    A slide that never exceeds `margin`, the least speed of a sliding foot, counts as sticking.
    """
    middle = (speed[1:] + speed[:-1]) / 2
    modes = [Mode.slipping(v) if abs(v) > margin / 10 else Mode.STICK for v in middle]
    for run in _grouped(modes):
        speeds = speed[run.first : run.first + run.count + 1]
        if run.mode.slips and np.max(np.abs(speeds)) < margin:
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
    runs = runs_of(x[transcription.variables[Unknown.SLIDE][1]], problem.margins.slip_speed)
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
    torque = np.array([np.interp(time, middles, row) for row in x[layout[Unknown.TORQUE]]])
    slide, speed = x[layout[Unknown.SLIDE]]
    return RelaxedSolution(
        durations_found=np.array([steps[run.first : run.first + run.count].sum() for run in runs]),
        time=time,
        found=Sample(x[layout[Unknown.ANGLES]], x[layout[Unknown.RATES]], torque, slide, speed),
        solution=None,
        label=f"what was found for '{problem.sequence}'",
    )
