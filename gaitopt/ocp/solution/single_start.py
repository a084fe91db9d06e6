"""Solution from a single start."""

import math
import time

from gaitopt.lazy import Deferred
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import nlp_data
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.certification import certify
from gaitopt.ocp.solution.diagnosis import violations
from gaitopt.ocp.solution.grid_solve import GridSolution, SingleStart
from gaitopt.ocp.solution.mesh_refinement import approach_through_coarse_grids, refine_mesh, repair_early_touchdown
from gaitopt.ocp.solution.problem_checks import report_poor_scaling
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.progress import Observer


def solve_from_start(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: Observer, cold_solver: NlpSolver | None = None
) -> Gait:
    """Solve a problem with a closed contact sequence from one start.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : NlpSolver
    observer : Observer
    cold_solver : NlpSolver, optional
        Solver of grids without a warm start, such as `solver` with fewer iterations.
    """
    return complete_solve(SingleStart(problem, guess, solver, observer, cold_solver))


def complete_solve(start: SingleStart, coarsest: GridSolution | None = None) -> Gait:
    """Return the gait of a start, whose solution on the coarsest grid may be known."""
    started, built, problem = time.perf_counter(), start.build_seconds, start.problem
    solution = repair_early_touchdown(start, refine_mesh(start, approach_through_coarse_grids(start, coarsest)))
    if math.isfinite(problem.transcription.tolerance):
        solution = solution.check_plan()
    transcription, outcome, remarks = solution.transcription, solution.outcome, start.check_guess()
    if not outcome.status.ok:
        remarks += report_poor_scaling(
            transcription, initial_point(transcription, problem, start.guess), nlp_data(transcription, problem)
        )
    unmet = violations(transcription, solution.limits, outcome.x, outcome.g)
    # Checks between the nodes are evaluated lazily: without a tolerance the solve has not needed them.
    return Gait(
        robot=problem.robot,
        sequence=problem.sequence,
        status=outcome.status,
        motion=Deferred(lambda: solution.motion),
        problem=problem.describe() | start.describe(solution),
        solver=SolverReport(
            iterations=start.iterations,
            objective=solution.cost,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=Deferred(lambda: solution.drift),
            build_seconds=start.build_seconds,
            solve_seconds=time.perf_counter() - started - (start.build_seconds - built),
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=Deferred(lambda: remarks + solution.warnings()),
        ),
        versions=versions(),
        solution=solution_of(transcription, outcome),
        certificate=Deferred(lambda: certify(solution)),
    )
