"""Proposals for an open impact: the smooth NLP with the impact law as complementarity pairs."""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution, select_admitted, select_simplest
from gaitopt.ocp.mode_search.complementarity_residual import complementarity_residual
from gaitopt.ocp.mode_search.homotopy import Homotopy, choose_relaxed_grid, follow_homotopy
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.trajectory import read_parameters, read_states
from gaitopt.ocp.statement.initial_guess import Guess, Sample
from gaitopt.ocp.transcription.nlp_builder import slide_columns
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import SolveObserver

AGREEMENT = 1e-3
"""Largest accepted relative difference between relaxed and closed cost on the same grid, mostly due to margins."""


def propose_impact(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, homotopy: Homotopy
) -> Candidates:
    """Follow the homotopy of a sequence whose impact alone is open, on the coarsest grid of its transcription."""
    transcription = transcribe(structure(problem, choose_relaxed_grid(problem, homotopy), homotopy.relaxation))
    path = follow_homotopy(
        homotopy,
        transcription,
        initial_point(transcription, problem, guess),
        data_vector(problem),
        bounds(transcription, problem),
        lambda x: impact_residual(transcription, problem, x),
        solver,
        observer,
    )
    x = np.nan_to_num(path.outcome.x)
    modes = list_outcomes_near(*impulse_and_speed(transcription, problem, x), problem)
    sequences = select_admitted([ContactSequence(problem.sequence.phases, mode) for mode in modes], problem.sequence)
    sequences = sequences or [select_simplest(problem.sequence)]
    relaxed_solution = _make_guess(transcription, problem, x, solution_of(transcription, path.outcome))
    return Candidates(
        path=path,
        sequences=tuple(sequences),
        guesses=(relaxed_solution,) * len(sequences),
        agreement=AGREEMENT,
        biactive=len(modes) > 1,
    )


def impulse_and_speed(transcription: Transcription, problem: GaitProblem, x: Array) -> tuple[float, float, float]:
    """Return the impulse per mass, tangential and normal, and the speed of the landing foot after it [m/s]."""
    layout, robot, first = transcription.variables, transcription.structure.robot, transcription.phases[0]
    p = robot.vector(read_parameters(transcription, problem, x))
    tangential, normal = x[layout[Unknown.IMPULSE][:, 0]] / float(robot.mass(p))
    columns = slide_columns(layout, first, [first.first])
    speed = x[columns[1, 0]] if columns.size else 0.0
    return float(tangential), float(normal), float(speed)


def impact_residual(transcription: Transcription, problem: GaitProblem, x: Array) -> float:
    """Return the complementarity residual of the impact in a solution [m/s]."""
    return complementarity_residual(*impulse_and_speed(transcription, problem, x), problem.friction)


def list_outcomes_near(tangential: float, normal: float, speed: float, problem: GaitProblem) -> list[Mode]:
    """Return the outcomes consistent with an impact: one, or both that meet on the edge of the impact cone.

    Within the margins of the problem a relaxed solution does not distinguish the two.

    Parameters
    ----------
    tangential, normal : float
        Impulse per mass [m/s].
    speed : float [m/s]
        Speed of the landing foot after the impact.
    problem : GaitProblem
    """
    if abs(speed) > problem.margins.slip_speed:
        return [Mode.slipping(speed)]
    inside = 1 - abs(tangential) / max(problem.friction * normal, 1e-12)
    if inside > 2 * problem.margins.impact_cone:
        return [Mode.STICK]
    return [Mode.STICK, Mode.slipping(-tangential)]


def _make_guess(transcription: Transcription, problem: GaitProblem, x: Array, solution: Solution) -> RelaxedSolution:
    layout = transcription.variables
    durations = x[layout[Unknown.DURATION][0]]
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    slide, speed = np.zeros((2, transcription.n_nodes))
    time, place = np.zeros(transcription.n_nodes), 0.0
    for phase, dynamics in zip(transcription.phases, transcription.dynamics_of_phases, strict=True):
        nodes = list(phase.nodes)
        time[nodes] = np.linspace(ends[phase.number], ends[phase.number + 1], len(nodes))
        slide[nodes] = place
        if phase.slides:
            states = read_states(transcription, phase, x)[0]
            slide[nodes], speed[nodes] = place + states[dynamics.slide_entry], states[dynamics.speed_entry]
        place = slide[nodes[-1]]
    motion = Sample(x[layout[Unknown.ANGLES]], x[layout[Unknown.RATES]], x[layout[Unknown.TORQUE]], slide, speed)
    return RelaxedSolution(durations, time, motion, solution, f"relaxed solution of '{problem.sequence}'")
