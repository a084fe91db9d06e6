"""Mesh refinement: from coarse grids to a plan that is accurate between its nodes and touches down at its end."""

import math
from collections.abc import Callable
from dataclasses import replace

from gaitopt.errors import InputError
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.ipopt import STOPPED
from gaitopt.ocp.nlp.nlp_solver import Barrier
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.cost_refinement import choose_default_grid, move_schedule, record_cost
from gaitopt.ocp.solution.diagnosis import ROUNDING
from gaitopt.ocp.solution.grid_solve import (
    BARRIER_COARSE_GRID,
    BARRIER_NEARBY_PROBLEM,
    BARRIER_SAME_GRID,
    BARRIER_SAME_PROBLEM,
    STOPPED_EARLY,
    GridSolution,
    SingleStart,
)
from gaitopt.ocp.solution.swing_foot_checks import early_touchdown
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, shift_arming
from gaitopt.ocp.transcription.method import Method

MOST_DOUBLINGS = 2
"""Largest number of doublings for a contact mode that is violated between the points of its constraints."""

MAX_GUARD_REPAIRS = 3
"""Largest number of solves with guard constraints for a plan that touches down early."""

GAIN = 1e-4
"""Relative decrease of the objective that justifies another shift of the node at which the touchdown is armed."""

MAX_WORK_RESOLVES = 10
"""Largest number of solves with located sign changes of the joint powers."""

WORK_TOLERANCE = 2e-5
"""Relative difference of the minimised value from the cost of the plan above which sign changes are located again."""

NEGLIGIBLE = 1e-6
"""Share of a typical objective below which costs are zero."""

Refinement = Callable[[SingleStart, GridSolution], GridSolution]
"""Refinement of a solution after the solve on its grid."""


def find_coarsest_grid(problem: GaitProblem) -> Method:
    """Return the coarsest grid of a problem; raise InputError if its transcription has none."""
    grids = problem.transcription.list_grids(problem.sequence)
    if not grids:
        raise _missing_grids(problem)
    return grids[0]


def _missing_grids(problem: GaitProblem) -> InputError:
    name = type(problem.transcription).__name__
    return InputError(f"{name}.list_grids must return at least one grid, got none.")


def solve_coarsest_grid(start: SingleStart) -> GridSolution:
    """Return the solution on the coarsest grid, without an early touchdown if one is found."""
    solution = start.solve_on_grid(find_coarsest_grid(start.problem), None, BARRIER_SAME_PROBLEM)
    return _exclude_early_touchdown(start, solution, _keep_mesh) if solution.outcome.status.ok else solution


def approach_through_coarse_grids(start: SingleStart, coarsest: GridSolution | None = None) -> GridSolution:
    """Return the solution on the grid of the problem, warm-started from coarser grids.

    An early touchdown is excluded on the first grid whose plan has one.

    Parameters
    ----------
    start : SingleStart
    coarsest : GridSolution, optional
        Result of `solve_coarsest_grid` if it is known.
    """
    problem, guess = start.problem, start.guess
    grids, warm_start = problem.transcription.list_grids(problem.sequence), None
    barrier: Barrier = BARRIER_SAME_PROBLEM
    known = guess.solution_for(problem.sequence)
    if known is not None:
        grids, warm_start, barrier = grids[-1:], known, BARRIER_NEARBY_PROBLEM
        start.known_factor = known.cost_factor
    elif not guess.needs_coarse_grids:
        grids = grids[-1:]
    solution, coarse = None, None
    for method in grids:
        coarse = solution
        if coarse is not None:
            warm_start = solution_of(coarse.transcription, coarse.outcome)
        equal, schedule = method, start.schedule
        if method is grids[-1] and warm_start is not None:
            method = choose_default_grid(start, method, warm_start)
            if coarse is not None and method is not equal:
                move_schedule(start, coarse, method)
                barrier = BARRIER_NEARBY_PROBLEM  # on other nodes other constraints are active
        if coarse is None and coarsest is not None:
            solution = coarsest
        else:
            solution = start.solve_on_grid(method, warm_start, barrier)
        if solution.outcome.status in STOPPED and coarse is not None:
            return coarse.mark_stopped(solution.outcome)
        if solution.outcome.status.ok and solution is not coarsest:
            solution = _exclude_early_touchdown(start, solution, _keep_mesh)
        if solution.outcome.status in STOPPED_EARLY:
            return solution
        if not solution.outcome.status.ok:
            start.schedule = schedule
            break
        record_cost(start, solution)
        # On another grid the clearance is active at other points.
        barrier = BARRIER_COARSE_GRID if problem.limits.clearance is None else BARRIER_NEARBY_PROBLEM
    if solution is None:
        raise _missing_grids(problem)
    if solution.outcome.status.ok or coarse is None:
        return solution
    return start.solve_on_grid(grids[-1], None, BARRIER_SAME_PROBLEM)  # a grid finer than the coarsest failed


def refine_mesh(start: SingleStart, solution: GridSolution, doublings: int = MOST_DOUBLINGS) -> GridSolution:
    """Return the solution refined to the tolerance, or to the end of the refinement after some doublings at most."""
    problem, resolves, least_violation = start.problem, MAX_WORK_RESOLVES, math.inf
    tolerance = problem.transcription.tolerance
    while solution.outcome.status.ok and math.isfinite(tolerance):
        if resolves and solution.between.drift <= tolerance:
            exact = _minimise_exact_work(start, solution)
            if exact is not None:
                solution, resolves = exact, resolves - 1
                continue
        if not solution.error <= tolerance:
            solution = solution.refine_feasibility()
        method, inaccurate = None, not solution.error <= tolerance
        if inaccurate:
            method = solution.method.refine()
        violation = solution.between.outside
        # A violation that a doubling has not reduced remains on finer grids; that of a contact mode is 1 on any grid.
        reduced = violation < least_violation or violation == 1
        repeat = inaccurate or (violation > ROUNDING and reduced) or solution.scuffs()
        if method is None and doublings and repeat and _may_double(start, solution):
            method, doublings = solution.method.double_intervals(problem.sequence), doublings - 1
            least_violation = violation
        if method is None:
            break
        coarse = solution
        warm_start = solution_of(coarse.transcription, coarse.outcome)
        solution = start.solve_on_grid(method, warm_start, BARRIER_SAME_PROBLEM)
        if solution.outcome.status in STOPPED:
            return coarse.mark_stopped(solution.outcome)
    return solution.check_finite() if math.isfinite(tolerance) else solution


def _may_double(start: SingleStart, solution: GridSolution) -> bool:
    """Return whether a doubled grid has at most as many intervals as that of the problem after all doublings."""
    sequence = start.problem.sequence
    most = 2**MOST_DOUBLINGS * sum(start.problem.transcription.intervals_for(sequence))
    return 2 * sum(solution.method.intervals_for(sequence)) <= most


def _minimise_exact_work(start: SingleStart, solution: GridSolution) -> GridSolution | None:
    """Return the solution with the sign changes of the joint powers as data, or None if it is not needed or not better.

    If no sign has changed since they were located, the minimised value is the cost of the plan.
    """
    scale = max(abs(solution.cost), NEGLIGIBLE * start.problem.objective.typical)
    agree = abs(solution.outcome.objective - solution.cost) <= WORK_TOLERANCE * scale
    if agree or not solution.has_other_sign_changes():
        return None
    warm_start = solution_of(solution.transcription, solution.outcome)
    barrier: Barrier = BARRIER_SAME_GRID if solution.method.fractions is None else BARRIER_SAME_PROBLEM
    exact = start.solve_on_grid(solution.method, warm_start, barrier)
    if exact.outcome.status in STOPPED_EARLY:
        return solution.mark_stopped(exact.outcome)
    return exact if exact.outcome.status.ok and exact.cost <= solution.cost + WORK_TOLERANCE * scale else None


def repair_early_touchdown(start: SingleStart, solution: GridSolution) -> GridSolution:
    """Return a nearby solution that does not touch down before its end, or the given one if none is found."""
    if solution.transcription.structure.schedule is not None:
        solution = _release_guard(start, solution)
    return _improve_arming_node(start, _exclude_early_touchdown(start, solution, refine_mesh))


def _release_guard(start: SingleStart, solution: GridSolution) -> GridSolution:
    """Return the solution without the guard constraints of a coarse grid if they are not needed and raise the cost."""
    schedule = solution.transcription.structure.schedule
    if not solution.outcome.status.ok:
        return solution
    released = _solve_with_guard(start, solution, None)
    if released.outcome.status in STOPPED_EARLY:
        return released
    lower = released.outcome.status.ok and released.cost <= solution.cost
    if lower and early_touchdown(released.transcription, start.problem, released.x) is None:
        return released
    start.schedule = schedule
    return solution


def _keep_mesh(start: SingleStart, solution: GridSolution) -> GridSolution:
    return solution


def _exclude_early_touchdown(start: SingleStart, solution: GridSolution, refine: Refinement) -> GridSolution:
    """Return a nearby solution with guard constraints if the given one touches down early and one exists."""
    tries = MAX_GUARD_REPAIRS if math.isfinite(start.problem.transcription.tolerance) else 0
    for number in range(tries):
        early = None
        if solution.outcome.status.ok:
            early = early_touchdown(solution.transcription, start.problem, solution.x)
        if early is None:
            break
        schedule = replace(early.schedule, least=early.schedule.least * 4**number)
        repaired = _solve_with_guard(start, solution, schedule, refine)
        if not repaired.outcome.status.ok:
            start.schedule = solution.transcription.structure.schedule
            return repaired if repaired.outcome.status in STOPPED_EARLY else solution
        solution = repaired
    return solution


def _solve_with_guard(
    start: SingleStart, solution: GridSolution, schedule: GuardSchedule | None, refine: Refinement = refine_mesh
) -> GridSolution:
    """Solve again from a solution, with or without guard constraints; if interrupted, return the given solution."""
    start.schedule = schedule
    warm_start = solution_of(solution.transcription, solution.outcome)
    constrained = refine(start, start.solve_on_grid(solution.method, warm_start, BARRIER_NEARBY_PROBLEM))
    if constrained.outcome.status in STOPPED_EARLY:
        return solution.mark_stopped(constrained.outcome)
    return constrained


def _improve_arming_node(start: SingleStart, solution: GridSolution) -> GridSolution:
    """Return the lowest-cost solution over shifts of the node at which the touchdown is armed."""
    for side in (-1, 1):
        while schedule := shift_arming(solution.transcription.phases, solution.transcription.structure.schedule, side):
            shifted = _solve_with_guard(start, solution, schedule)
            if shifted.outcome.status in STOPPED_EARLY:
                return shifted
            decrease = solution.cost - shifted.cost
            if not shifted.outcome.status.ok or not decrease > GAIN * abs(solution.cost):
                break
            if early_touchdown(shifted.transcription, start.problem, shifted.x) is not None:
                break
            solution = shifted
    return solution
