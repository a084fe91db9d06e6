"""Grid refinement for the objective: nodes are moved to the jumps of the torques until the estimated error is small."""

import math

from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.bounds import transcribe_problem
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.solution.cost_error import NEGLIGIBLE, GridCost, estimate_factor
from gaitopt.ocp.solution.grid_solve import BARRIER_SAME_PROBLEM, STOPPED_EARLY, GridSolution, SingleStart
from gaitopt.ocp.solution.node_placement import allot_intervals, distribute_nodes, find_ramps
from gaitopt.ocp.transcription.guard_constraints import transfer_schedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.reductions import rank_of
from gaitopt.status import Status

GROWTH = (1, 1.6, 2.5)
"""Total number of intervals of each refinement, relative to the first grid."""


def choose_default_grid(start: SingleStart, method: Method, solution: Solution) -> Method:
    """Return a method whose nodes are placed by the torques of a solution, if its grid is the default one.

    A solution with placed nodes keeps them if the grid is refined later where necessary, and otherwise their number.
    """
    default = method.intervals is None and method.fractions is None
    if not default or not math.isfinite(method.largest_cost_error):
        return method
    if solution.fractions is not None and _refines(start):
        return method.replace_grid(solution.intervals, solution.fractions)
    ramps = find_ramps(solution)
    if ramps is None or len(ramps.nodes) != len(start.problem.sequence.phases):
        return method
    total = sum(method.intervals_for(start.problem.sequence))
    counts = allot_intervals(ramps, total) if solution.fractions is None else solution.intervals
    return method.replace_grid(counts, distribute_nodes(ramps, counts))


def move_schedule(start: SingleStart, solution: GridSolution, method: Method) -> None:
    """Move the schedule of the touchdown guard from the nodes of a solution to those of a method."""
    if start.schedule is not None:
        after = transcribe_problem(start.problem, method).phases
        start.schedule = transfer_schedule(start.schedule, solution.transcription.phases, after)


def refine_for_cost(start: SingleStart, solution: GridSolution) -> tuple[list[GridSolution], bool]:
    """Refine the grid of a solution until the estimated error of the objective is at most its tolerance.

    Returns
    -------
    list of GridSolution
        The solutions on all grids, lowest cost first.
    bool
        Whether the solve on a finer grid has failed.
    """
    solutions, tolerance = [solution], start.problem.transcription.largest_cost_error
    for growth in GROWTH[start.refinements :] if _refines(start) else ():
        if not solution.outcome.status.ok or cost_error(start, solution) <= tolerance:
            break
        start.refinements += 1
        ramps = solution.ramps
        if ramps is None:
            break
        known = solution_of(solution.transcription, solution.outcome)
        total = sum(start.problem.transcription.intervals_for(start.problem.sequence))
        counts = known.intervals if growth == 1 else allot_intervals(ramps, round(growth * total))
        method = solution.method.replace_grid(counts, distribute_nodes(ramps, counts))
        schedule = start.schedule
        move_schedule(start, solution, method)
        finer = start.solve_on_grid(method, known, BARRIER_SAME_PROBLEM)
        if finer.outcome.status in STOPPED_EARLY:
            return [solution.mark_stopped(finer.outcome)], False
        if not finer.outcome.status.ok:
            start.schedule = schedule
            return _sort_by_cost(solutions), True
        record_cost(start, finer)
        solution = finer
        solutions.append(finer)
    return _sort_by_cost(solutions), False


def _sort_by_cost(solutions: list[GridSolution]) -> list[GridSolution]:
    return sorted(solutions, key=lambda one: rank_of(one.cost))


def record_cost(start: SingleStart, solution: GridSolution) -> None:
    """Add the solution on a grid to the record of a start."""
    if solution.outcome.status.ok:
        start.grid_solutions.append(solution)


def cost_factor(start: SingleStart, solution: GridSolution) -> float:
    """Return the error of the objective per variation of the torques; nan if only one grid is known."""
    others = [one for one in start.grid_solutions if one is not solution]
    last = _grid_cost(solution) if others else None
    if last is None:
        return start.known_factor
    factor = estimate_factor([cost for one in others if (cost := _grid_cost(one)) is not None], last)
    return start.known_factor if math.isnan(factor) else factor


def cost_error(start: SingleStart, solution: GridSolution) -> float:
    """Return the estimated relative difference of the objective from its value on an infinitely fine grid, or nan."""
    factor = cost_factor(start, solution)
    if math.isnan(factor) or solution.outcome.status not in (Status.SOLVED, Status.PLAN_INACCURATE):
        return math.nan
    last = _grid_cost(solution)
    if last is None:
        return math.nan
    return factor * last.variation / max(abs(last.cost), NEGLIGIBLE * start.problem.objective.typical)


def report_cost_error(start: SingleStart, solution: GridSolution, *, failed: bool) -> tuple[str, ...]:
    """Return a sentence about an objective whose estimated error is too large; empty if it is not."""
    tolerance, error = start.problem.transcription.largest_cost_error, cost_error(start, solution)
    if not _refines(start) or not (failed or error > tolerance):
        return ()
    counts = solution.method.intervals_for(start.problem.sequence)
    reason = "the solve on a finer grid failed" if failed else "the refinement has ended"
    amount = f" by {100 * error:.2g} %" if math.isfinite(error) else ""
    return (
        f"The objective on {sum(counts)} intervals may exceed its value on a finer grid{amount} "
        f"(cost_tolerance {100 * tolerance:g} %): {reason}.",
    )


def _refines(start: SingleStart) -> bool:
    method = start.problem.transcription
    return math.isfinite(method.tolerance) and math.isfinite(method.largest_cost_error)


def _grid_cost(solution: GridSolution) -> GridCost | None:
    ramps = solution.ramps
    if ramps is None or not math.isfinite(solution.cost):
        return None
    return GridCost(solution.cost, ramps.variation, ramps.wide_variation)
