"""Multi-start solution of one problem: several starts on a coarse grid, the best on the fine grid, then a replay."""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from attrs import evolve

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Unknown, table_name
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.cost_error import GridCost, estimate_factor
from gaitopt.ocp.solution.infeasibility import conclude_failure
from gaitopt.ocp.solution.iteration_limits import RETRY
from gaitopt.ocp.solution.node_placement import find_ramps
from gaitopt.ocp.solution.passive_gait import passive_cycle
from gaitopt.ocp.solution.single_start import solve_from_start as solve_from
from gaitopt.ocp.solution.start_selection import is_same_solution
from gaitopt.ocp.statement.initial_guess import Guess, LinearGuess, RandomPerturbation
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart
from gaitopt.ocp.transcription.method import Method
from gaitopt.progress import silent
from gaitopt.reductions import rank_of
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.verification import verify
from gaitopt.status import Status

COARSE_SOLVER = Newton(fallback=Ipopt(tolerance=1e-5, max_iterations=100))
"""On the coarse grid; most feasible contact sequences converge within half of these iterations."""

MOST_INFEASIBLE_ITERATIONS = 40, 20
"""Iterations on the coarse grid after which a start ends if it is far from feasible: without a failed start before it,
and after one.  At seven friction coefficients, none of 405 starts of the compass biped that converge is after the first
number, and those that fail take half of the time; of no sequence does a start converge after one that fails.  At
another speed it ends two starts that converge later; other starts of these sequences remain.
"""

START_SOLVER, RETRY_SOLVER = (
    Newton(fallback=COARSE_SOLVER.fallback.with_patience(most, max_iterations=COARSE_SOLVER.fallback.max_iterations))
    for most in MOST_INFEASIBLE_ITERATIONS
)
"""On the coarse grid from starts that may fail, because the sequence may be infeasible; the second after a failure."""

FINE_SOLVER = Newton(fallback=Ipopt(max_iterations=300))

CONCLUDE = Newton()
"""Solver of :func:`gaitopt.solve`, used after a failure, so that studies and `solve` classify failures alike."""

CONCLUDING_STARTS = 3
"""Number of starts near which a feasible motion is sought after a failure."""

LARGE_VIOLATION, MAX_FAILED_STARTS = 1e-3, 2
"""Constraint violation above which a start has failed, and the number of such failures after which none is tried."""

START_SLOPE = math.radians(1)
"""Slope whose passive cycle serves as a start on level ground."""

COST_RANGE, MAX_CANDIDATES = 0.02, 2
"""Coarse solutions are solved on the fine grid if they exceed the lowest cost by at most this, relatively, and at most
this many that differ."""


def solve_start(problem: GaitProblem, start: Gait | Guess, solver: Newton = FINE_SOLVER) -> Gait:
    """Solve a problem from a guess, or warm-started from a gait of any contact sequence and grid.

    Parameters
    ----------
    problem : GaitProblem
    start : Gait or Guess
    solver : Newton

    Raises
    ------
    KeyboardInterrupt
        If the user interrupts it: the last iterate is not a result of a study.
    """
    guess = WarmStart(start, f"a gait '{start.sequence}'", start.sequence) if isinstance(start, Gait) else start
    gait = solve_from(problem, guess, solver, silent)
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return gait.without_certificate()  # its evaluation takes as long as a solve


def neighbour_of(gait: Gait) -> ContactSequence | None:
    """Return the contact sequence of the gait from which a study solved a gait, or None if it was another guess.

    Examples
    --------
    >>> from gaitopt import load
    >>> neighbour_of(load("docs/examples/compass_slip.h5")) is None
    True
    """
    sequence = gait.problem.get("neighbour")  # files of earlier versions do not contain it
    return None if sequence is None else ContactSequence.parse(sequence)


def estimate_cost_factor(gait: Gait, coarse: Gait) -> Gait:
    """Return a gait with the error of its objective per variation of the torques.

    It follows from the gait on a coarser grid; gaits that are warm-started from this one are estimated with it.
    """
    if gait.solution is None or coarse.solution is None:
        return gait
    ramps = find_ramps(coarse.solution), find_ramps(gait.solution)
    if ramps[0] is None or ramps[1] is None:
        return gait
    before, after = (
        GridCost(each.solver.objective, ramp.variation, ramp.wide_variation)
        for each, ramp in ((coarse, ramps[0]), (gait, ramps[1]))
    )
    factor = estimate_factor([before], after)
    return gait.replace_fields(solution=replace(gait.solution, cost_factor=factor))


def default_starts(problem: GaitProblem, count: int) -> list[Guess]:
    """Return the first `count` starts: guess of the problem or linear guess, passive cycle if any, perturbations."""
    parameters = {**problem.parameters, "slope": abs(problem.values["slope"]) or START_SLOPE}
    cycle = _passive(problem.robot, tuple(parameters.items())) if count > 1 else None
    first = [problem.guess or LinearGuess(), *([] if cycle is None else [FromMotion(cycle, "a passive cycle")])]
    return [*first, *(RandomPerturbation(seed) for seed in range(1, count))][:count]


@functools.lru_cache(maxsize=16)
def _passive(robot: Robot, parameters: tuple[tuple[str, float], ...]) -> Motion | None:
    values = dict(parameters)
    try:
        return passive_cycle(robot, values.pop("slope"), values)
    except InputError:
        return None


def solve_coarse(problem: GaitProblem, starts: Sequence[Gait | Guess], *, after_failure: bool = False) -> list[Gait]:
    """Return the solutions on a coarse grid from each start, lowest cost first; without any, the best failure.

    Starts are tried in turn, after a failure with fewer iterations; if the first `MAX_FAILED_STARTS` fail, the others
    are omitted.

    Parameters
    ----------
    problem : GaitProblem
    starts : sequence of Gait or Guess
    after_failure : bool
        Whether other starts of the problem have failed before.
    """
    coarse = coarsen(problem)
    solved: list[Gait] = []
    failed: list[Gait] = []
    failures = 0
    for start in starts:
        gait = solve_start(coarse, start, RETRY_SOLVER if failures or after_failure else START_SOLVER)
        (solved if gait.status.ok else failed).append(gait)
        failures += not gait.status.ok and not gait.solver.constraint_violation <= LARGE_VIOLATION
        if not solved and failures >= MAX_FAILED_STARTS:
            break
    return sorted(solved, key=objective) if solved else [best(failed)]


def objective(gait: Gait | PlanarGait) -> float:
    """Return the minimised objective of a gait; infinite unless it is a solution."""
    return rank_of(gait.solver.objective) if gait.status.ok else math.inf


def solve_cold(problem: GaitProblem, starts: int) -> list[Gait]:
    """Return the solutions from the default starts of a problem, lowest cost first."""
    return solve_fine(problem, solve_coarse(problem, default_starts(problem, starts)))


def solve_fine(problem: GaitProblem, coarse: Sequence[Gait]) -> list[Gait]:
    """Solve the best coarse solutions on the problem's grid, lowest cost first; a failure is returned as it is.

    The record of each gait states the start of its coarse solution.
    """
    if not coarse[0].status.ok:
        return [coarse[0]]
    starts = [WarmStart(gait, gait.problem["guess"], neighbour_of(gait)) for gait in select_candidates(coarse)]
    fine = [solve_start(problem, start) for start in starts]
    return sorted(fine, key=_rank)


def select_leading(problem: GaitProblem, coarse: Sequence[Gait]) -> Gait:
    """Return the coarse solution of lowest cost on the problem's grid, where the order may differ."""
    candidates = select_candidates(coarse) if coarse[0].status.ok else []
    return coarse[0] if len(candidates) < 2 else min(candidates, key=lambda gait: _rank(solve_start(problem, gait)))


def select_candidates(coarse: Sequence[Gait]) -> list[Gait]:
    """Return the coarse solutions, sorted by cost, that may have the lowest cost on a finer grid."""
    chosen: list[Gait] = []
    for gait in coarse:
        near = objective(gait) <= objective(coarse[0]) * (1 + COST_RANGE)
        if near and len(chosen) < MAX_CANDIDATES and not any(_same_solution(gait, other) for other in chosen):
            chosen.append(gait)
    return chosen


def best(gaits: Sequence[Gait]) -> Gait:
    """Return the solution of lowest cost, the first of equals; without any, the failure of smallest violation."""
    return min(gaits, key=_rank)


def verify_best(problem: GaitProblem, gaits: Sequence[Gait]) -> Gait:
    """Return the gait of lowest cost that passes replay, otherwise that of lowest cost, or the explained failure."""
    result = verify_by_cost(problem, gaits)
    if result.status not in RETRY or result.solver.conflicts:
        return result
    guesses = default_starts(problem, CONCLUDING_STARTS)
    concluded = conclude_failure(problem, result, guesses, CONCLUDE, silent, isolate_conflicts=False)
    if concluded.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return verify_by_cost(problem, [concluded.without_certificate()])


def verify_by_cost(problem: GaitProblem, gaits: Sequence[Gait]) -> Gait:
    """Return the gait of lowest cost that passes replay, otherwise that of lowest cost with its verification."""
    verified, engine = [], default_engine(robot=problem.robot)
    for gait in sorted(gaits, key=_rank):
        verified.append(verify(gait.with_robot(problem.robot), engine=engine) if gait.status.ok else gait)
        if verified[-1].status.ok:
            return verified[-1]
    return verified[0]


def _rank(gait: Gait) -> tuple[float, float]:
    return objective(gait), rank_of(gait.solver.constraint_violation)


def _same_solution(one: Gait, other: Gait) -> bool:
    durations = _read_durations(one), _read_durations(other)
    return is_same_solution((objective(one), objective(other)), durations, abs(objective(one)))


def _read_durations(gait: Gait) -> Array:
    """Return the durations of the phases; those of the unknowns, because the motion is costly to evaluate."""
    if gait.solution is not None:
        return gait.solution.unknowns[table_name(Unknown.DURATION)].values[0]
    return np.array([segment.duration for segment in gait.motion.segments])


def coarsen(problem: GaitProblem) -> GaitProblem:
    """Return the problem on the coarsest grid of its transcription, without a tolerance on the integration error."""
    return _without_tolerance(problem, problem.transcription.list_grids(problem.sequence)[0])


def skip_refinement(problem: GaitProblem) -> GaitProblem:
    """Return the problem on its grid, without a tolerance on the integration error."""
    return _without_tolerance(problem, problem.transcription)


def _without_tolerance(problem: GaitProblem, method: Method) -> GaitProblem:
    return problem.replace(transcription=evolve(method, tolerance=math.inf))
