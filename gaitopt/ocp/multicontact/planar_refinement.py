"""Refinement of the grid of a planar robot: for the accuracy between nodes, the replay and the objective."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Protocol

from attrs import evolve

from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.method import MOST_INTERVALS
from gaitopt.status import Status

MOST_FOR_REPLAY = 2
"""Largest number of refinements of an accurate plan that is predicted to fail its replay."""

MOST_FOR_COST = 3
"""Largest number of refinements for the objective."""


class RefiningStart(Protocol):
    """Solves from one start."""

    def exclude_invalid_touchdowns(self, result: GridResult, *, from_below: bool) -> GridResult:
        """Return a solution whose contacts do not close too early or from below, or the last solution before."""

    def solve_on_finer_grid(self, result: GridResult, method: Collocation, *, from_below: bool) -> GridResult:
        """Return the solution on a finer grid near another one, without invalid touchdowns if possible."""


def refine_plan(start: RefiningStart, result: GridResult, methods: Sequence[Collocation]) -> GridResult:
    """Return the solution without invalid touchdowns that is accurate between its nodes, or one marked otherwise.

    Touchdowns from below are excluded last: those of an inaccurate plan may not be those of the gait.  The objective is
    last of all, because its grids begin with an accurate plan.
    """
    remaining = iter(methods)
    for from_below in (False, True):
        result = start.exclude_invalid_touchdowns(result, from_below=from_below)
        result = _refine(start, result, remaining, from_below=from_below)
    if result.has_invalid_touchdown:
        return result.mark_inaccurate()
    return _refine_for_cost(start, _refine_for_replay(start, result, remaining))


def _refine(
    start: RefiningStart, result: GridResult, methods: Iterator[Collocation], *, from_below: bool
) -> GridResult:
    """Return the solution with more points or intervals, until it is accurate between its nodes."""
    tolerance, coarser = result.problem.transcription.tolerance, None
    while result.outcome.status.ok and math.isfinite(tolerance) and not result.error <= tolerance:
        method = next(methods, None)
        if method is None:
            return result.mark_inaccurate(coarser_errors=coarser)
        finer = start.solve_on_finer_grid(result, method, from_below=from_below)
        if finer.outcome.status is Status.INTERRUPTED:
            return result.mark_interrupted(finer.outcome.message)
        if not finer.outcome.status.ok:
            return result.mark_inaccurate(f"{finer.outcome.status.key} on {sum(finer.problem.counts)} intervals")
        result, coarser = finer, result.errors
    return result


def _refine_for_replay(start: RefiningStart, result: GridResult, methods: Iterator[Collocation]) -> GridResult:
    """Return the solution with more points or intervals if the given one is predicted to fail its replay.

    A solution on a finer grid that is not accurate, or not predicted to be closer to its replay, is discarded.
    """
    for _ in range(MOST_FOR_REPLAY):
        method = next(methods, None) if result.outcome.status.ok and result.fails_replay else None
        if method is None:
            break
        finer = start.solve_on_finer_grid(result, method, from_below=True)
        if finer.outcome.status is Status.INTERRUPTED:
            return result.mark_interrupted(finer.outcome.message)
        if not (_is_accurate(finer) and finer.replay_error < result.replay_error):
            break
        result = finer
    return result


def _refine_for_cost(start: RefiningStart, result: GridResult) -> GridResult:
    """Return the solution on a finer grid, until twice the intervals change the objective by at most its tolerance.

    Torques are linear between nodes, so that those of a grid are also torques of the grid with twice the intervals: a
    refinement only decreases the least objective.  A difference that exceeds the tolerance on the last grid, and a
    solve that fails on it, are stated by a warning.
    """
    tolerance = result.problem.transcription.cost_tolerance
    if tolerance is None or not math.isfinite(tolerance):
        return result
    best = result
    for number in itertools.count():
        if not best.outcome.status.ok or result.cost_error <= tolerance:
            break
        method = _double_intervals(result.problem.transcription, result.problem.counts)
        if number == MOST_FOR_COST or method is None:
            return best.mark_costly("the refinement has ended")
        finer = start.solve_on_finer_grid(result, method, from_below=True)
        if finer.outcome.status is Status.INTERRUPTED:
            return best.mark_interrupted(finer.outcome.message)
        if not _is_accurate(finer):
            return best.mark_costly(f"the solve on {sum(finer.problem.counts)} intervals failed")
        result = finer.compare_cost(result)
        best = result if result.outcome.objective <= best.outcome.objective else best.compare_cost(result)
    if best.outcome.status.ok and best.cost_error > tolerance:
        return best.mark_costly("the solve on a finer grid converged to a local optimum of higher cost")
    return best


def _double_intervals(method: Collocation, counts: tuple[int, ...]) -> Collocation | None:
    """Return the method with twice the intervals, or None if they exceed `MOST_INTERVALS`."""
    doubled = tuple(2 * count for count in counts)
    return None if max(doubled) > MOST_INTERVALS else evolve(method, intervals=doubled)


def _is_accurate(result: GridResult) -> bool:
    """Return whether a solution is accurate between its nodes and has no invalid touchdown."""
    within = result.error <= result.problem.transcription.tolerance
    return result.outcome.status.ok and within and not result.has_invalid_touchdown
