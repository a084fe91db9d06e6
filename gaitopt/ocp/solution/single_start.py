"""One attempt at a gait: from one start to a plan."""

import time

from gaitopt.lazy import Deferred
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import data_vector
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.diagnosis import violations
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.mesh_refinement import approach_through_coarse_grids, refine_mesh, repair_early_touchdown
from gaitopt.ocp.solution.problem_checks import report_poor_scaling
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.progress import Observer


def solve_from_start(problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: Observer) -> Gait:
    """Solve from one start."""
    began, own = time.perf_counter(), SingleStart(problem, guess, solver, observer)
    step = repair_early_touchdown(own, refine_mesh(own, approach_through_coarse_grids(own)))
    transcription, outcome, remarks = step.transcription, step.outcome, own.remarks()
    if not outcome.status.ok:
        remarks += report_poor_scaling(
            transcription, initial_point(transcription, problem, guess), data_vector(problem)
        )
    unmet = violations(transcription, step.limits, outcome.x, outcome.g)
    # Without a tolerance nothing has been looked at between the nodes; that can wait until somebody asks.
    return Gait(
        robot=problem.robot,
        sequence=problem.sequence,
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
