"""One attempt at a gait: from one start through coarse grids to a plan that is accurate between its nodes."""

import math
import time

import numpy as np

from gaitopt.motion.energy import ledger
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.solution import Solution
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.carrying import carried, solution_of
from gaitopt.ocp.diagnosis import violations, warnings
from gaitopt.ocp.guess import Continued, Guess
from gaitopt.ocp.ipopt import Ipopt, Outcome
from gaitopt.ocp.method import Method
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.readout import error_between_nodes, found_values, read_motion
from gaitopt.ocp.start import start
from gaitopt.ocp.transcription import Transcription, transcribe
from gaitopt.progress import Observer

SAME, NEAR = 1e-6, 1e-5
"""Barrier parameters to go on with from the same problem on another grid, and from another problem."""


class Attempt:
    """A solve in progress: counts what it costs.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : Ipopt
    observer : Observer
    """

    def __init__(self, problem: GaitProblem, guess: Guess, solver: Ipopt, observer: Observer) -> None:
        self.problem, self.guess, self.solver, self.observer = problem, guess, solver, observer
        self.iterations, self.build_seconds = 0, 0.0

    def run(self, method: Method, before: Solution | None, barrier: float) -> tuple[Transcription, Outcome]:
        """Solve on one grid, from a solution or else from the guess."""
        problem = self.problem
        began, known = time.perf_counter(), transcribe.cache_info().misses
        transcription = transcribe(structure(problem, method))
        if transcribe.cache_info().misses > known:
            self.build_seconds += time.perf_counter() - began
        x, multipliers = start(transcription, problem, self.guess), None
        if before is not None:
            x, multipliers = carried(before, transcription, x)
        outcome = self.solver.minimise(
            transcription.nlp,
            x,
            data_vector(problem),
            bounds(transcription, problem),
            self.observer,
            multipliers,
            barrier,
        )
        self.iterations += outcome.iterations
        return transcription, outcome


def attempt(problem: GaitProblem, guess: Guess, solver: Ipopt, observer: Observer) -> Gait:
    """Solve from one start."""
    began, own = time.perf_counter(), Attempt(problem, guess, solver, observer)
    path, before, barrier = problem.transcription.approach(problem.word), None, SAME
    known = guess.solution_for(problem.word) if isinstance(guess, Continued) else None
    if known is not None:
        path, before, barrier = path[-1:], known, NEAR
    for method in path:
        transcription, outcome = own.run(method, before, barrier)
        if not outcome.status.ok:
            break
        before, barrier = solution_of(transcription, outcome), SAME
    while True:
        x = np.nan_to_num(outcome.x, nan=0.0, posinf=0.0, neginf=0.0)
        values = found_values(transcription, problem, x)
        motion = read_motion(transcription, values, x)
        error = error_between_nodes(transcription, values, x) if outcome.status.ok else math.inf
        worst = max(error, ledger(motion).relative_residual)
        finer = method.finer()
        if not outcome.status.ok or worst <= problem.transcription.tolerance or finer is None:
            break
        method = finer
        transcription, outcome = own.run(method, solution_of(transcription, outcome), SAME)
    unmet = violations(transcription, bounds(transcription, problem), outcome.x, outcome.g)
    return Gait(
        robot=problem.robot.name,
        word=problem.word,
        status=outcome.status,
        motion=motion,
        problem=problem.describe() | {"guess": guess.describe(), "transcription": method.name},
        solver=SolverReport(
            iterations=own.iterations,
            objective=outcome.objective,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=error,
            build_seconds=own.build_seconds,
            solve_seconds=time.perf_counter() - began - own.build_seconds,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=warnings(transcription, problem, outcome.x, worst) if outcome.status.ok else (),
        ),
        versions=versions(),
        solution=solution_of(transcription, outcome),
    )
