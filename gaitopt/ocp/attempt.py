"""One attempt at a gait: from one start to a plan."""

import time

from gaitopt.later import Deferred
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import data_vector
from gaitopt.ocp.carrying import solution_of
from gaitopt.ocp.diagnosis import violations
from gaitopt.ocp.guess import Guess
from gaitopt.ocp.outcome import Minimiser
from gaitopt.ocp.presolve import poorly_scaled
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.refinement import approached, landed, refined
from gaitopt.ocp.start import start
from gaitopt.ocp.step import Attempt
from gaitopt.progress import Observer


def attempt(problem: GaitProblem, guess: Guess, solver: Minimiser, observer: Observer) -> Gait:
    """Solve from one start."""
    began, own = time.perf_counter(), Attempt(problem, guess, solver, observer)
    step = landed(own, refined(own, approached(own)))
    transcription, outcome, remarks = step.transcription, step.outcome, own.remarks()
    if not outcome.status.ok:
        remarks += poorly_scaled(transcription, start(transcription, problem, guess), data_vector(problem))
    unmet = violations(transcription, step.limits, outcome.x, outcome.g)
    # Without a tolerance nothing has been looked at between the nodes; that can wait until somebody asks.
    return Gait(
        robot=problem.robot.name,
        word=problem.word,
        status=outcome.status,
        motion=Deferred(lambda: step.motion),
        problem=problem.describe() | own.found(step),
        solver=SolverReport(
            iterations=own.iterations,
            objective=outcome.objective,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=Deferred(step.drift),
            build_seconds=own.build_seconds,
            solve_seconds=time.perf_counter() - began - own.build_seconds,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=Deferred(lambda: remarks + step.warnings()),
        ),
        versions=versions(),
        solution=solution_of(transcription, outcome),
    )
