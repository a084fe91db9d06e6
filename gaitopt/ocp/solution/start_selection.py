"""Several starts of one problem: all are solved on the coarsest grid, and those of lowest cost are refined."""

import time
from collections.abc import Sequence

import numpy as np

from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.grid_solve import GridSolution, SingleStart
from gaitopt.ocp.solution.mesh_refinement import NEGLIGIBLE, solve_coarsest_grid
from gaitopt.ocp.solution.single_start import complete_solve
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.progress import Observer
from gaitopt.reductions import rank_of
from gaitopt.status import Status

COST_RANGE, MOST_REFINED = 0.02, 2
"""Coarse solutions are refined if they exceed the lowest cost by at most this, relatively, and at most this many that
differ."""

SAME_COST, EQUAL_COST, SAME_DURATION = 1e-4, 1e-6, 1e-3
"""Relative differences of cost: below the first, solutions with phase durations that differ by less than the third, in
units of the period, are the same; below the second, all are."""


def solve_from_starts(
    problem: GaitProblem, guesses: Sequence[Guess], solver: NlpSolver, observer: Observer, cold_solver: NlpSolver
) -> list[Gait]:
    """Return the gaits of the best starts; if the first one fails on the coarsest grid, its failure alone.

    The reports of the gaits contain the iterations and the time of all starts.

    Parameters
    ----------
    problem : GaitProblem
        A problem with a closed contact sequence.
    guesses : sequence of Guess
    solver : NlpSolver
    observer : Observer
    cold_solver : NlpSolver
        Solver of the coarsest grid.
    """
    began = time.perf_counter()
    starts = [SingleStart(problem, guess, solver, observer, cold_solver) for guess in guesses]
    if len(starts) == 1 or not starts[0].needs_coarse_grids():
        gaits = [complete_solve(starts[0])]
        others = starts[1:] if gaits[0].status.ok else []
    else:
        gaits, others = [], starts
    if others:
        gaits += _refine_best(problem, others, _solve_coarsest_grids(others))
    return _report_totals(gaits, starts, began)


def _refine_best(problem: GaitProblem, starts: list[SingleStart], solutions: list[GridSolution]) -> list[Gait]:
    """Return the gaits refined from the best different solutions on the coarsest grid, or the failure of the first."""
    stopped, gaits = solutions[-1].outcome, list[Gait]()
    candidates = _rank(problem, solutions) or [0]
    lowest = solutions[candidates[0]].cost
    for position, number in enumerate(candidates):
        solution = solutions[number]
        near = solution.cost - lowest <= COST_RANGE * _scale(problem, lowest)
        if any(gait.status.ok for gait in gaits) and not (near and position < MOST_REFINED):
            break
        if stopped.status is Status.INTERRUPTED and solution.outcome.status.ok:
            solution = solution.mark_stopped(stopped)
        gaits.append(complete_solve(starts[number], solution))
        if gaits[-1].status is Status.INTERRUPTED:
            break
    return gaits


def _solve_coarsest_grids(starts: list[SingleStart]) -> list[GridSolution]:
    """Return the solutions on the coarsest grid; the others are omitted if the first fails or one is interrupted."""
    solutions: list[GridSolution] = []
    for start in starts:
        solutions.append(solve_coarsest_grid(start))
        if solutions[-1].outcome.status is Status.INTERRUPTED or not solutions[0].outcome.status.ok:
            break
    return solutions


def _rank(problem: GaitProblem, solutions: list[GridSolution]) -> list[int]:
    """Return the numbers of the different solutions, lowest cost first; of equal ones, that of the first start."""
    durations = [s.outcome.x[s.transcription.variables[Unknown.DURATION][0]] for s in solutions]
    different: list[int] = []
    for number, solution in enumerate(solutions):
        if solution.outcome.status.ok and not any(
            is_same_solution(
                (solutions[other].cost, solution.cost),
                (durations[other], durations[number]),
                _scale(problem, solutions[other].cost),
            )
            for other in different
        ):
            different.append(number)
    return sorted(different, key=lambda number: rank_of(solutions[number].cost))


def is_same_solution(costs: tuple[float, float], durations: tuple[Array, Array], scale: float) -> bool:
    """Return whether two solutions of a problem are the same, from their costs and the durations of their phases.

    Parameters
    ----------
    costs : pair of float
    durations : pair of (n_phases,) arrays [s]
    scale : float
        Size of the cost to which differences are relative.
    """
    difference = abs(costs[1] - costs[0]) / scale
    if difference > SAME_COST or difference < EQUAL_COST:
        return difference < EQUAL_COST
    one, other = durations
    return bool(np.max(np.abs(other - one)) < SAME_DURATION * one.sum())


def _scale(problem: GaitProblem, cost: float) -> float:
    return max(abs(cost), NEGLIGIBLE * problem.objective.typical)


def _report_totals(gaits: list[Gait], starts: list[SingleStart], began: float) -> list[Gait]:
    """Return the gaits with the iterations and the time of all starts; if interrupted, only the best one.

    Its status then is that of the interrupt, also if its own solve was complete.
    """
    iterations, build = sum(start.iterations for start in starts), sum(start.build_seconds for start in starts)
    seconds = time.perf_counter() - began - build
    interrupted = gaits[-1].status is Status.INTERRUPTED
    solved = [gait for gait in gaits if gait.status.ok]
    if interrupted and solved:
        best = min(solved, key=lambda gait: rank_of(gait.solver.objective))
        gaits = [best.with_failure(Status.INTERRUPTED, f"{gaits[-1].solver.message}; another start was solved before")]
    totals = {"iterations": iterations, "build_seconds": build, "solve_seconds": seconds}
    return [gait.replace_fields(solver=gait.solver.replace_fields(**totals)) for gait in gaits]
