"""One contact sequence at one place of a study: solved from several starts, on a coarse grid first, and replayed."""

import functools
import math
from collections.abc import Sequence

import numpy as np
from attrs import evolve

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Motion
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.passive_gait import passive_cycle
from gaitopt.ocp.solution.single_start import solve_from_start as solve_from
from gaitopt.ocp.statement.initial_guess import Guess, LinearGuess, RandomPerturbation
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart
from gaitopt.ocp.transcription.method import Method
from gaitopt.progress import silent
from gaitopt.reductions import rank_of
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.verification import verify
from gaitopt.status import Status

COARSE_SOLVER = Newton(fallback=Ipopt(tolerance=1e-5, max_iterations=100))
"""On the coarse grid; most contact sequences that can be walked are found within half of that."""

FINE_SOLVER = Newton(fallback=Ipopt(max_iterations=300))

CONCLUDE = Newton()
"""Solver of :func:`gaitopt.solve`.  It continues a failure that `COARSE_SOLVER` stopped at its iteration limit, so that
studies and `solve` classify failures alike."""

LARGE_VIOLATION, MAX_FAILED_STARTS = 1e-3, 2
"""A start that violates the constraints by more than this has failed; at most this many failures."""

GENTLE = math.radians(1)
"""Slope whose passive cycle serves as a start on level ground."""

WORTH, ALIKE, EQUAL, FINISHED = 0.02, 1e-4, 1e-6, 2
"""Coarse solutions are finished if dearer than the cheapest by at most `WORTH`, not `ALIKE`, and at most so many.

Alike are those of nearly the same cost and phases, and those whose costs are `EQUAL`, between which nobody can choose.
"""


def solve_start(problem: GaitProblem, start: Gait | Guess, solver: Newton = FINE_SOLVER) -> Gait:
    """Solve a problem from a guess, or from a gait of any contact sequence and grid.

    Raises
    ------
    KeyboardInterrupt
        If the user stopped it: the last iterate is no result of a study.
    """
    guess = WarmStart(start, f"a gait '{start.sequence}'") if isinstance(start, Gait) else start
    gait = solve_from(problem, guess, solver, silent)
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return gait


def default_starts(problem: GaitProblem, count: int) -> list[Guess]:
    """Return the first `count` starts of a problem: its own guess or a line, a passive cycle if one exists, waves."""
    parameters = {**problem.parameters, "slope": abs(problem.values["slope"]) or GENTLE}
    cycle = _passive(problem.robot, tuple(parameters.items())) if count > 1 else None
    first = [problem.guess or LinearGuess(), *([] if cycle is None else [FromMotion(cycle, "a passive cycle")])]
    return [*first, *(RandomPerturbation(seed) for seed in range(1, count))][:count]


@functools.lru_cache(maxsize=16)
def _passive(robot: Robot, parameters: tuple[tuple[str, float], ...]) -> Motion | None:
    given = dict(parameters)
    try:
        return passive_cycle(robot, given.pop("slope"), given)
    except InputError:
        return None


def solve_coarse(problem: GaitProblem, starts: Sequence[Gait | Guess]) -> list[Gait]:
    """Return what is found on a coarse grid from each start: solutions, cheapest first, or else the best failure.

    Starts are tried in turn; when the first `MAX_FAILED_STARTS` lead nowhere, the others are spared.
    """
    coarse = coarsen(problem)
    found: list[Gait] = []
    failed: list[Gait] = []
    for start in starts:
        gait = solve_start(coarse, start, COARSE_SOLVER)
        (found if gait.status.ok else failed).append(gait)
        if (
            not found
            and sum(not other.solver.constraint_violation <= LARGE_VIOLATION for other in failed) >= MAX_FAILED_STARTS
        ):
            break
    return sorted(found, key=objective) if found else [best(failed)]


def objective(gait: Gait) -> float:
    """Return what a gait was optimised for; infinite unless it is a solution."""
    return rank_of(gait.solver.objective) if gait.status.ok else math.inf


def solve_cold(problem: GaitProblem, starts: int) -> list[Gait]:
    """Return what is found from starts of the problem's own, cheapest first."""
    return solve_fine(problem, solve_coarse(problem, default_starts(problem, starts)))


def solve_fine(problem: GaitProblem, coarse: Sequence[Gait]) -> list[Gait]:
    """Return the cheapest of coarse solutions on the problem's own grid, cheapest first; a failure as it is."""
    if not coarse[0].status.ok:
        return [coarse[0]]
    return sorted((solve_start(problem, gait) for gait in _rivals(coarse)), key=_rank)


def select_leading(problem: GaitProblem, coarse: Sequence[Gait]) -> Gait:
    """Return the coarse solution that is the cheapest on the problem's own grid, on which two may change places."""
    rivals = _rivals(coarse) if coarse[0].status.ok else []
    return coarse[0] if len(rivals) < 2 else min(rivals, key=lambda gait: _rank(solve_start(problem, gait)))


def _rivals(coarse: Sequence[Gait]) -> list[Gait]:
    """Return of coarse solutions, cheapest first, those that may be the cheapest on a finer grid."""
    chosen: list[Gait] = []
    for gait in coarse:
        near = objective(gait) <= objective(coarse[0]) * (1 + WORTH)
        if near and len(chosen) < FINISHED and not any(_alike(gait, other) for other in chosen):
            chosen.append(gait)
    return chosen


def best(gaits: Sequence[Gait]) -> Gait:
    """Return the cheapest solution, the first one of equals; without any, the failure nearest to one."""
    return min(gaits, key=_rank)


def verify_best(problem: GaitProblem, gaits: Sequence[Gait]) -> Gait:
    """Return the gait of lowest cost that passes replay, otherwise that of lowest cost, or the concluded failure."""
    verdict = _verified(problem, gaits)
    if verdict.status is not Status.ITERATION_LIMIT:
        return verdict
    again = solve_start(coarsen(problem), verdict, CONCLUDE)
    return _verified(problem, solve_fine(problem, [again])) if again.status.ok else again


def _verified(problem: GaitProblem, gaits: Sequence[Gait]) -> Gait:
    """Return the gait of lowest cost that passes replay, otherwise that of lowest cost with its verdict."""
    verdicts = []
    for gait in sorted(gaits, key=_rank):
        verdicts.append(verify(gait, problem.robot, engine=default_engine()) if gait.status.ok else gait)
        if verdicts[-1].status.ok:
            return verdicts[-1]
    return verdicts[0]


def _rank(gait: Gait) -> tuple[float, float]:
    return objective(gait), rank_of(gait.solver.constraint_violation)


def _alike(one: Gait, other: Gait) -> bool:
    apart = abs(objective(one) - objective(other)) / abs(objective(one))
    if apart > ALIKE or apart < EQUAL:
        return apart < EQUAL
    durations = np.array([[segment.duration for segment in gait.motion.segments] for gait in (one, other)])
    return bool(np.ptp(durations, axis=0).max() < 1e-3 * one.period)


def coarsen(problem: GaitProblem) -> GaitProblem:
    """Return the problem on the first grid of its method's approach, however rough the integration there."""
    return _roughly(problem, problem.transcription.list_grids(problem.sequence)[0])


def halve_intervals(problem: GaitProblem) -> GaitProblem:
    """Return the problem on a grid half as fine as its own, from which the fine one is a short way."""
    return _roughly(problem, problem.transcription.coarsen(problem.sequence, 2) or problem.transcription)


def _roughly(problem: GaitProblem, method: Method) -> GaitProblem:
    return problem.replace(transcription=evolve(method, tolerance=math.inf))
