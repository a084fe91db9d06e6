"""Proposals for open phases: the contact modes of a relaxed time-stepping NLP."""

import itertools

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution, select_admitted, select_simplest
from gaitopt.ocp.mode_search.complementarity_residual import complementarity_residual
from gaitopt.ocp.mode_search.homotopy import Homotopy, choose_relaxed_grid, follow_homotopy
from gaitopt.ocp.mode_search.impact_proposal import impact_residual, impulse_and_speed, list_outcomes_near
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.initial_guess import Guess, Sample
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import SolveObserver
from gaitopt.reductions import worst

AGREEMENT = 0.1
"""Largest accepted relative difference between relaxed and closed cost; the relaxed grid is of low order."""

MOST_SEQUENCES = 3
"""Largest number of proposed contact sequences that are solved."""

BRIEF = 2
"""Number of intervals below which a run of equal modes may be an artefact of the grid."""


def propose_phases(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, homotopy: Homotopy
) -> Candidates:
    """Follow the homotopy of a contact sequence with open phases on a separate grid."""
    transcription = transcribe(structure(problem, choose_relaxed_grid(problem, homotopy), homotopy.relaxation))
    path = follow_homotopy(
        homotopy,
        transcription,
        initial_point(transcription, problem, guess),
        data_vector(problem),
        bounds(transcription, problem),
        lambda x: worst(impact_residual(transcription, problem, x), friction_residual(transcription, problem, x)),
        solver,
        observer,
    )
    x = np.nan_to_num(path.outcome.x)
    impacts = [problem.sequence.impact]
    if problem.sequence.impact is Mode.ANY:
        impacts = list_outcomes_near(*impulse_and_speed(transcription, problem, x), problem)
    guesses = propose_sequence(transcription, problem, x, impacts)
    return Candidates(
        path=path,
        sequences=tuple(guesses),
        guesses=tuple(guesses.values()),
        agreement=AGREEMENT,
        biactive=len(impacts) > 1,
        on_edge=count_on_cone_edge(transcription, problem, x),
    )


def interval_lengths(transcription: Transcription, x: Array) -> Array:
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


def count_on_cone_edge(transcription: Transcription, problem: GaitProblem, x: Array) -> int:
    """Return the number of intervals of open phases with a stick on the edge of the cone, within the margins."""
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


def find_runs(speed: Array, margin: float) -> list[ModeRun]:
    """Return the runs of equal contact modes from the speed of the foot at the nodes, shape (N+1,) [m/s].

    A slide whose speed never exceeds `margin` counts as sticking.
    """
    middle = (speed[1:] + speed[:-1]) / 2
    modes = [Mode.slipping(v) if abs(v) > margin / 10 else Mode.STICK for v in middle]
    for run in _group_modes(modes):
        speeds = speed[run.first : run.first + run.count + 1]
        if run.mode.slips and np.max(np.abs(speeds)) < margin:
            modes[run.first : run.first + run.count] = [Mode.STICK] * run.count
    return _group_modes(modes)


def drop_brief_runs(runs: list[ModeRun], kept: Mode) -> list[ModeRun]:
    """Return runs with those of fewer than `BRIEF` intervals joined to the run before, or after at the start.

    The first run stays if it has the mode `kept`, the slip that the impact starts.
    """
    modes: list[Mode | None] = []
    for i, run in enumerate(runs):
        brief = run.count < BRIEF and not (i == 0 and run.mode is kept)
        modes += [(modes[-1] if modes else None) if brief else run.mode] * run.count
    known = next((mode for mode in modes if mode is not None), Mode.STICK)
    return _group_modes([mode or known for mode in modes])


def _group_modes(modes: list[Mode]) -> list[ModeRun]:
    runs, first = [], 0
    for mode, group in itertools.groupby(modes):
        count = len(list(group))
        runs.append(ModeRun(mode, first, count))
        first += count
    return runs


def propose_sequence(
    transcription: Transcription, problem: GaitProblem, x: Array, impacts: list[Mode]
) -> dict[ContactSequence, RelaxedSolution]:
    """Return the sequences a relaxed solution proposes, likeliest first, and the initial guesses of their solves."""
    runs = find_runs(x[transcription.variables[Unknown.SLIDE][1]], problem.margins.slip_speed)
    choices: dict[ContactSequence, list[ModeRun]] = {}
    for impact in impacts:
        for choice in (drop_brief_runs(runs, impact), runs):
            if impact.slips and choice[0].mode is not impact:
                choice = [ModeRun(impact, 0, 1), *_drop_first_interval(choice)]
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


def _drop_first_interval(runs: list[ModeRun]) -> list[ModeRun]:
    """Return runs without the first interval."""
    first, *others = runs
    return others if first.count == 1 else [ModeRun(first.mode, first.first + 1, first.count - 1), *others]


def _start_of(transcription: Transcription, problem: GaitProblem, x: Array, runs: list[ModeRun]) -> RelaxedSolution:
    layout, steps = transcription.variables, interval_lengths(transcription, x)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    middles = (time[1:] + time[:-1]) / 2
    torque = np.array([np.interp(time, middles, row) for row in x[layout[Unknown.TORQUE]]])
    slide, speed = x[layout[Unknown.SLIDE]]
    return RelaxedSolution(
        phase_durations=np.array([steps[run.first : run.first + run.count].sum() for run in runs]),
        time=time,
        motion=Sample(x[layout[Unknown.ANGLES]], x[layout[Unknown.RATES]], torque, slide, speed),
        solution=None,
        label=f"relaxed solution of '{problem.sequence}'",
    )
