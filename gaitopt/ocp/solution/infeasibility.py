"""Conclusion from a failed solve: a gait from a motion that satisfies all limits, or the conflicting limits."""

import time
from collections.abc import Sequence
from typing import ClassVar

from gaitopt.dataclass import dataclass
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import Gait
from gaitopt.ocp.nlp.elastic import ElasticResult
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.conflict_search import elastic_solver
from gaitopt.ocp.solution.feasibility import ElasticProblem
from gaitopt.ocp.solution.inaccurate_plans import InaccuratePlans
from gaitopt.ocp.solution.mesh_refinement import STOPPED_EARLY
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.warm_start import FromMotion
from gaitopt.progress import Observer
from gaitopt.reductions import rank_of
from gaitopt.status import Status

SMALL_EXCESS = 0.01
"""Weighted sum of the slacks below which a finer grid may have a gait where the coarse one has none."""

AGREEMENT, LARGE_EXCESS = 0.01, 0.03
"""Relative difference of the least excesses near two starts below which, and their size above which, no other start is
tried: from each of four starts, the excess of 33 of 33 feasible problems was below 1e-4."""

MOST_UNDECIDED = 2
"""Number of starts without a conclusion after which no other is tried."""

LABEL = "a motion that satisfies all limits"
"""Label of the guess from a feasible motion, for the record of the gait."""


def conclude_failure(
    problem: GaitProblem,
    failure: Gait,
    guesses: Sequence[Guess],
    solver: NlpSolver,
    observer: Observer,
    plans: InaccuratePlans | None = None,
    *,
    isolate_conflicts: bool = True,
) -> Gait:
    """Return a gait solved from a feasible motion, or the failure with its reason.

    The motion of least excess over all limits is determined near each guess on the coarsest grid.  If one exceeds no
    limit, the problem is solved from it; if all exceed some limit, the problem is infeasible near the guesses, and the
    conflicting limits are reported.

    Parameters
    ----------
    problem : GaitProblem
        A problem with a closed contact sequence.
    failure : Gait
        Result of a solve that failed.  If it stopped at an iteration limit and a feasible motion exists, it is first
        repeated from the first guess with the iteration limit of `solver`.
    guesses : sequence of Guess
    solver : NlpSolver
    observer : Observer
    plans : InaccuratePlans, optional
        Inaccurate plans of the problem, to which others are added.
    isolate_conflicts : bool
        Whether the conflicting limits of an infeasible problem are determined one by one; otherwise those that the
        motion of least excess exceeds are reported, which are a few more in some problems.
    """
    try:
        search = _Search(problem, failure, guesses, solver, observer, InaccuratePlans() if plans is None else plans)
        return search.run(isolate=isolate_conflicts)
    except KeyboardInterrupt:
        return failure.with_failure(Status.INTERRUPTED, "User_Requested_Stop")


@dataclass(frozen=True, eq=False)
class FineMotion(FromMotion):
    """A motion that satisfies all limits on the fine grid, although none was found on the coarsest one."""

    needs_coarse_grids: ClassVar[bool] = False


class _Search:
    """The search for a feasible motion near several guesses."""

    def __init__(
        self,
        problem: GaitProblem,
        failure: Gait,
        guesses: Sequence[Guess],
        solver: NlpSolver,
        observer: Observer,
        plans: InaccuratePlans,
    ) -> None:
        self._plans = plans
        self._problem, self._failure, self._solver, self._observer = problem, failure, solver, observer
        self._grids = problem.transcription.list_grids(problem.sequence)
        self._elastic_solver = elastic_solver(solver, len(problem.sequence.phases))
        self._elastic = ElasticProblem(problem, self._grids[0], self._elastic_solver, observer)
        self._started, self._guesses = time.perf_counter(), guesses
        self._infeasible: list[ElasticResult] = []
        # An inaccurate plan satisfies all limits at its nodes: the problem is not infeasible.
        self._unsolved = [failure] if failure.status is Status.PLAN_INACCURATE else []
        self._undecided: list[Status] = []

    def _seconds(self) -> float:
        return time.perf_counter() - self._started

    def run(self, *, isolate: bool) -> Gait:
        """Return the conclusion."""
        if self._failure_is_coarse():
            return self._conclude_from_coarse_solution(isolate=isolate)
        for guess in self._guesses:
            gait = self._try(self._elastic, guess)
            if gait is not None:
                return gait
            if self._is_decided():
                break
        if self._unsolved:
            return self._report_failure()
        if not self._infeasible:
            return self._conclude_with_fixed_parameters(isolate=isolate) or self._conclude_without_result()
        nearest, count = min(self._infeasible, key=self._elastic.excess), len(self._infeasible)
        if self._elastic.excess(nearest) < SMALL_EXCESS and len(self._grids) > 1:
            gait = self._try(self._fine_problem(), FromMotion(self._elastic.motion(nearest)))
            if gait is not None:
                return gait
        near = f"any of {count} initial guesses" if count > 1 else "the initial guess"
        return self._report_conflicts(self._elastic, nearest, near, isolate=isolate)

    def _failure_is_coarse(self) -> bool:
        """Return whether the failure is a solution on a coarse grid whose refinement reached the iteration limit."""
        failure = self._failure
        finest = tuple(self._grids[-1].intervals_for(self._problem.sequence))
        is_coarse = failure.solution is not None and tuple(failure.problem["intervals"]) != finest
        return failure.status is Status.ITERATION_LIMIT and is_coarse and not failure.solver.violations

    def _conclude_from_coarse_solution(self, *, isolate: bool) -> Gait:
        """Return the conclusion if the problem is feasible on a coarse grid."""
        fine = self._fine_problem()
        gait = self._try(fine, FromMotion(self._failure.motion))
        if gait is not None:
            return gait
        if self._unsolved:
            return self._report_failure()
        if not self._infeasible:
            return self._failure
        return self._report_conflicts(fine, self._infeasible[0], "the solution on a coarse grid", isolate=isolate)

    def _fine_problem(self) -> ElasticProblem:
        return ElasticProblem(self._problem, self._grids[-1], self._elastic_solver, self._observer)

    def _report_conflicts(self, elastic: ElasticProblem, nearest: ElasticResult, near: str, *, isolate: bool) -> Gait:
        """Return the failure as infeasible, with the conflicting limits, unless a feasible motion is found."""
        conflicts: tuple[Conflict, ...] | ElasticResult = ()
        if not self._unsolved:
            conflicts = elastic.find_conflicts(nearest) if isolate else elastic.list_excesses(nearest)
        if isinstance(conflicts, ElasticResult):
            gait, conflicts = self._solve_from(elastic, conflicts), ()
            if gait is not None:
                return gait
        if self._unsolved:
            return self._report_failure()
        message = f"no feasible motion found near {near}: the smallest possible violation of the limits is not zero"
        return self._failure.with_failure(Status.INFEASIBLE, message, conflicts, seconds=self._seconds())

    def _is_decided(self) -> bool:
        """Return whether no other start is tried."""
        excesses, undecided = list(map(self._elastic.excess, self._infeasible)), len(self._undecided)
        is_large = min(excesses, default=0.0) > LARGE_EXCESS
        return undecided >= MOST_UNDECIDED or (is_large and undecided > 0) or excesses_agree(excesses)

    def _try(self, elastic: ElasticProblem, guess: Guess) -> Gait | None:
        """Return the gait solved from the feasible motion near a guess, or that of a stopped solve; otherwise None."""
        result = elastic.minimise_excess(guess)
        if result.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if result.status in STOPPED_EARLY:
            return self._failure.with_failure(result.status, "stopped during the search for a feasible motion")
        if elastic.is_feasible(result):
            return self._solve_from(elastic, result)
        if result.status.ok:
            self._infeasible.append(result)
        else:
            self._undecided.append(result.status)
        return None

    def _solve_from(self, elastic: ElasticProblem, result: ElasticResult) -> Gait | None:
        """Return the gait solved from a feasible motion, or that of a stopped solve; otherwise None."""
        motion = elastic.motion(result)
        starts: list[Guess] = [
            FromMotion(motion, LABEL) if elastic is self._elastic else FineMotion(motion, LABEL),
        ]
        if self._failure.status is Status.ITERATION_LIMIT and not self._unsolved:
            starts.insert(0, self._guesses[0])
        for start in starts:
            gait = solve_from_start(self._problem, start, self._solver, self._observer, None, self._plans)
            if gait.status.ok or gait.status in STOPPED_EARLY:
                return gait
            self._unsolved.append(gait)
        return None

    def _conclude_with_fixed_parameters(self, *, isolate: bool) -> Gait | None:
        """Return the conclusion with the free parameters at their start; what suffices then suffices in general."""
        problem, failure = self._problem, self._failure
        if not problem.free:
            return None
        fixed = problem.fix_parameters({name: problem.values[name] for name in problem.free})
        search = _Search(fixed, failure, self._guesses, self._solver, self._observer, InaccuratePlans())
        gait = search.run(isolate=isolate)
        if gait.status.ok:
            start = FromMotion(gait.motion, LABEL)
            gait = solve_from_start(problem, start, self._solver, self._observer, None, self._plans)
            if gait.status.ok or gait.status in STOPPED_EARLY:
                return gait
            self._unsolved.append(gait)
            return self._report_failure()
        if gait.status in STOPPED_EARLY:
            return failure.with_failure(gait.status, gait.solver.message)
        if search._unsolved:  # a motion with these parameters satisfies all limits
            self._unsolved.append(failure)
            return self._report_failure()
        if not gait.solver.conflicts:
            return None
        message = f"{gait.solver.message} with the free parameters at their initial values"
        return failure.with_failure(Status.INFEASIBLE, message, gait.solver.conflicts, seconds=self._seconds())

    def _conclude_without_result(self) -> Gait:
        """Return the failure; it is infeasible if the equations of the sequence have no solution without limits."""
        if any(status is not Status.INFEASIBLE for status in self._undecided):
            return self._failure
        near = f"any of {count} initial guesses" if (count := len(self._undecided)) > 1 else "the initial guess"
        message = f"no motion with this sequence found near {near}, even without limits"
        return self._failure.with_failure(Status.INFEASIBLE, message, seconds=self._seconds())

    def _report_failure(self) -> Gait:
        """Return the best failure from a feasible motion, which is not infeasible."""
        gait = min(self._unsolved, key=lambda gait: rank_of(gait.solver.constraint_violation))
        if gait.status is not Status.INFEASIBLE:
            return gait
        message = f"{gait.solver.message}, from a motion that satisfies all limits on a coarse grid"
        return gait.with_failure(Status.FAILED, message)


def excesses_agree(excesses: Sequence[float]) -> bool:
    """Return whether the two least excesses found near some starts are large, or equal."""
    least = sorted(excesses)[:2]
    return len(least) == 2 and (least[0] > LARGE_EXCESS or least[1] - least[0] <= AGREEMENT * least[0])
