"""Solution from a single start."""

import math
import time
from dataclasses import replace
from functools import partial

from gaitopt.lazy import Deferred
from gaitopt.model.plausible_sizes import report_implausible_sizes
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.motion import Motion
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import nlp_data
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.cost_refinement import cost_error, cost_factor, refine_for_cost, report_cost_error
from gaitopt.ocp.solution.diagnosis import violations
from gaitopt.ocp.solution.grid_solve import GridSolution, PortableSolution, SingleStart
from gaitopt.ocp.solution.inaccurate_plans import InaccuratePlans
from gaitopt.ocp.solution.mesh_refinement import (
    MOST_DOUBLINGS,
    STOPPED_EARLY,
    approach_through_coarse_grids,
    refine_mesh,
    repair_early_touchdown,
    solve_coarsest_grid,
)
from gaitopt.ocp.solution.problem_checks import report_poor_scaling
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.limits import report_implausible_angles
from gaitopt.progress import Observer
from gaitopt.status import Status


def solve_from_start(
    problem: GaitProblem,
    guess: Guess,
    solver: NlpSolver,
    observer: Observer,
    cold_solver: NlpSolver | None = None,
    plans: InaccuratePlans | None = None,
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
    plans : InaccuratePlans, optional
        Inaccurate plans of the problem; a plan is returned if its solution on the coarsest grid is found again.
    """
    start = SingleStart(problem, guess, solver, observer, cold_solver)
    if plans is None or not guess.needs_coarse_grids or guess.solution_for(problem.sequence) is not None:
        return complete_solve(start)
    try:
        coarsest = solve_coarsest_grid(start)
        known = plans.find(coarsest)
    except KeyboardInterrupt:
        if start.latest is None:
            raise
        return complete_solve(start, mark_interrupted(start.latest))
    if known is not None:
        return known
    gait = complete_solve(start, coarsest)
    plans.add(coarsest, gait)
    return gait


def complete_solve(start: SingleStart, coarsest: GridSolution | None = None) -> Gait:
    """Return the gait of a start, whose solution on the coarsest grid may be known.

    After an interrupt between the solves on two grids, the gait is the last solution.
    """
    problem = start.problem
    try:
        solution, remarks = _solve_accurately(start, coarsest)
    except KeyboardInterrupt:
        if start.latest is None:
            raise
        solution, remarks = mark_interrupted(start.latest), ()
    if solution.outcome.status.ok:
        solution = solution.place_parameters_on_bounds()
    transcription, outcome = solution.transcription, solution.outcome
    if not outcome.status.ok:
        remarks += report_poor_scaling(
            transcription, initial_point(transcription, problem, start.guess), nlp_data(transcription, problem)
        )
    gait = assemble_gait(solution, start.describe(solution), remarks)
    known = gait.solution and replace(gait.solution, cost_factor=cost_factor(start, solution))
    report = gait.solver.replace_fields(
        iterations=start.iterations,
        build_seconds=start.build_seconds,
        solve_seconds=time.perf_counter() - start.began - start.build_seconds,
        cost_error=cost_error(start, solution),
    )
    return gait.replace_fields(solver=report, solution=known)


def mark_interrupted(solution: GridSolution) -> GridSolution:
    """Return the solution that remains after an interrupt between two solves."""
    stopped = replace(solution.outcome, status=Status.INTERRUPTED, message="User_Requested_Stop")
    return solution.mark_stopped(stopped)


def assemble_gait(solution: GridSolution, details: dict[str, object], remarks: tuple[str, ...] = ()) -> Gait:
    """Return the gait of a solution on one grid.

    Parameters
    ----------
    solution : GridSolution
    details : dict
        Entries of the problem's description that the solve determines.
    remarks : tuple of str
        Warnings besides those of the solution.
    """
    from gaitopt.ocp.solution.certification import defer_certificate  # which the solve itself does not need

    transcription, outcome, problem = solution.transcription, solution.outcome, solution.problem
    unmet = violations(transcription, solution.limits, outcome.x, outcome.g)
    portable = PortableSolution.of(solution)
    # Checks between the nodes are evaluated lazily: without a tolerance the solve has not needed them.
    return Gait(
        robot=problem.robot,
        sequence=problem.sequence,
        status=outcome.status,
        motion=Deferred(lambda: solution.motion, elsewhere=partial(_restore_motion, portable)),
        problem=Deferred(lambda: problem.describe() | details),
        solver=SolverReport(
            iterations=outcome.iterations,
            objective=solution.cost,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=Deferred(lambda: solution.drift, elsewhere=partial(_restore_drift, portable)),
            build_seconds=0.0,
            solve_seconds=0.0,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=Deferred(
                lambda: _collect_warnings(solution, remarks), elsewhere=partial(_restore_warnings, portable, remarks)
            ),
        ),
        versions=versions(),
        solution=solution_of(transcription, outcome),
        certificate=defer_certificate(solution),
    )


def _restore_motion(solution: PortableSolution) -> Motion:
    return solution.restore().motion


def _restore_drift(solution: PortableSolution) -> float:
    return solution.restore().drift


def _restore_warnings(solution: PortableSolution, remarks: tuple[str, ...]) -> tuple[str, ...]:
    return _collect_warnings(solution.restore(), remarks)


def _collect_warnings(solution: GridSolution, remarks: tuple[str, ...]) -> tuple[str, ...]:
    """Return all warnings; implausible sizes are the first ones, since others may follow from them."""
    problem = solution.problem
    angles = report_implausible_angles("Limits.angle", problem.limits.angle)
    return report_implausible_sizes(problem.robot, problem.values) + angles + remarks + solution.warnings()


def _solve_accurately(start: SingleStart, coarsest: GridSolution | None) -> tuple[GridSolution, tuple[str, ...]]:
    """Return the solution of a start and remarks on it: on the best of the refined grids whose plan is accurate."""
    result, failed = _refine(start, approach_through_coarse_grids(start, coarsest))
    tolerance = start.problem.transcription.largest_cost_error
    if result.outcome.status.ok and not failed and cost_error(start, result) > tolerance:
        finer, failed = _refine(start, result)  # the accurate plan has another error than the solution before it
        stopped = finer.outcome.status in STOPPED_EARLY
        result = finer if stopped or (finer.outcome.status.ok and finer.cost < result.cost) else result
    return result, start.check_guess() + report_cost_error(start, result, failed=failed)


def _refine(start: SingleStart, solution: GridSolution) -> tuple[GridSolution, bool]:
    """Return the solution of lowest cost on refined grids whose plan is accurate, and whether a finer grid failed."""
    solutions, failed = refine_for_cost(start, solution)
    results: list[GridSolution] = []
    for one in solutions:
        start.schedule = one.transcription.structure.schedule
        # The plan of a finer grid is inaccurate: those of coarser grids are accepted as they are or not at all.
        result = repair_early_touchdown(start, refine_mesh(start, one, 0 if results else MOST_DOUBLINGS))
        results.append(result.check_plan() if math.isfinite(start.problem.transcription.tolerance) else result)
        status = results[-1].outcome.status
        if status.ok or status in STOPPED_EARLY:
            return results[-1], failed or len(results) > 1
    return results[0], failed
