"""Several starts of one problem: all are solved on the coarsest grid, and those of lowest cost are refined."""

import math
import time
from collections.abc import Sequence

import numpy as np
from attrs import evolve

from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.initial.initial_point import setting
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.grid_solve import GridSolution, SingleStart
from gaitopt.ocp.solution.inaccurate_plans import InaccuratePlans
from gaitopt.ocp.solution.mesh_refinement import NEGLIGIBLE, find_coarsest_grid, solve_coarsest_grid
from gaitopt.ocp.solution.single_start import complete_solve, mark_interrupted
from gaitopt.ocp.statement.criteria import TorqueSquared
from gaitopt.ocp.statement.initial_guess import DelayedSwing, Guess, LinearGuess, RandomPerturbation
from gaitopt.ocp.statement.warm_start import FromMotion
from gaitopt.progress import Observer, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

COST_RANGE, MOST_REFINED = 0.005, 2
"""Coarse solutions are refined if they exceed the lowest cost by at most this, relatively, and at most this many that
differ.  In 29 random problems with several local optima, the lowest cost on the coarsest grid led to the lowest cost
on the grid of 40 intervals within 0.01 % or to a failure, after which the next solution is refined."""

NEIGHBOUR_TOLERANCE, NEIGHBOUR_ITERATIONS = 1e-5, 30
"""Tolerance and largest number of iterations of a neighbouring problem; of 180 feasible ones each needed at most 17."""

SAME_COST, EQUAL_COST, SAME_DURATION = 1e-4, 1e-6, 1e-3
"""Relative differences of cost: below the first, solutions with phase durations that differ by less than the third, in
units of the period, are the same; below the second, all are."""

NEAR_ANGLES, NEAR_TORQUES, SAMPLES = 0.05, 0.2, 41
"""Differences of two motions at some instants, relative to the range of the angles and to the largest torque, below
which they are the same start: in 23 of 23 random problems they led to the same solution."""

STICKING = ContactSequence.parse("stick | stick")


def list_starts(problem: GaitProblem, count: int | None = None) -> list[Guess | GaitProblem]:
    """Return the starts of a problem: guesses, and neighbouring problems whose solutions are guesses.

    By default, a problem with a guess has this one start, one with a smooth objective the linear guess.  Otherwise, the
    starts are the gait of least squared torques, that of the sticking sequence if the foot slips, and a delayed swing.
    One start is the guess of the problem or the linear guess.  Further starts are the linear guess and its random
    perturbations with fixed seeds.

    Parameters
    ----------
    problem : GaitProblem
    count : int, optional
    """
    smooth = problem.objective.smooth
    if count == 1 or (count is None and (smooth or problem.guess is not None)):
        return [problem.guess or LinearGuess()]
    starts: list[Guess | GaitProblem] = [] if problem.guess is None else [problem.guess]
    if smooth:
        starts.append(LinearGuess())
    else:
        starts += [_minimise_torques(problem, s) for s in dict.fromkeys((problem.sequence, STICKING))]
    starts.append(DelayedSwing())
    if count is None:
        return starts
    return [*starts, *([] if smooth else [LinearGuess()]), *map(RandomPerturbation, range(1, count))][:count]


def _minimise_torques(problem: GaitProblem, sequence: ContactSequence) -> GaitProblem:
    """Return the problem of least squared torques with a contact sequence, on the coarsest grid of a problem."""
    coarsest = find_coarsest_grid(problem)
    if sequence != problem.sequence:
        coarsest = coarsest.replace_grid((max(coarsest.intervals_for(problem.sequence)),) * len(sequence.phases))
    return problem.replace(
        sequence=sequence,
        objective=TorqueSquared(),
        stability=None,
        guess=None,
        transcription=evolve(coarsest, tolerance=math.inf),
        name=f"a gait of least squared torques, '{sequence}'",
    )


def _neighbour_solver(solver: NlpSolver) -> NlpSolver:
    """Return a solver of a neighbouring problem: few iterations, and no further accuracy than a guess needs."""
    ipopt = solver.fallback if isinstance(solver, Newton) else solver
    if not isinstance(ipopt, Ipopt):
        return solver
    tolerance = max(ipopt.tolerance, NEIGHBOUR_TOLERANCE)
    return evolve(ipopt, tolerance=tolerance, max_iterations=min(ipopt.max_iterations, NEIGHBOUR_ITERATIONS))


def solve_from_starts(
    problem: GaitProblem,
    starts: Sequence[Guess | GaitProblem],
    solver: NlpSolver,
    observer: Observer,
    cold_solver: NlpSolver,
    *,
    plans: InaccuratePlans | None = None,
    stop_if_same: bool = False,
) -> list[Gait]:
    """Return the gaits of the best starts; if the first one fails on the coarsest grid, its failure alone.

    The reports of the gaits contain the iterations and the time of all starts.

    Parameters
    ----------
    problem : GaitProblem
        A problem with a closed contact sequence.
    starts : sequence of Guess or GaitProblem
        Guesses, or neighbouring problems whose solutions on their coarsest grid are guesses.
    solver : NlpSolver
    observer : Observer
    cold_solver : NlpSolver
        Solver of the coarsest grid.
    plans : InaccuratePlans, optional
        Inaccurate plans of the problem, to which others are added.
    stop_if_same : bool
        Whether no other start is tried if the first two are motions that nearly agree, or have the same solution.  In
        119 random problems in which they had, a third start led to a lower cost in one.
    """
    plans = InaccuratePlans() if plans is None else plans
    return _Starts(problem, solver, observer, cold_solver, plans, stop_if_same=stop_if_same).solve(starts)


class _Starts:
    """The starts of a problem, and their solutions on the coarsest grid."""

    def __init__(
        self,
        problem: GaitProblem,
        solver: NlpSolver,
        observer: Observer,
        cold_solver: NlpSolver,
        plans: InaccuratePlans,
        *,
        stop_if_same: bool,
    ) -> None:
        self._plans, self._stop_if_same = plans, stop_if_same
        self._problem, self._solver, self._observer, self._cold_solver = problem, solver, observer, cold_solver
        self._began, self._all = time.perf_counter(), list[SingleStart]()
        self._coarse: list[tuple[SingleStart, GridSolution]] = []

    def solve(self, starts: Sequence[Guess | GaitProblem]) -> list[Gait]:
        """Return the gaits of the best starts, with the iterations and the time of all starts."""
        gaits, first = list[Gait](), starts[0]
        if isinstance(first, Guess) and (len(starts) == 1 or not self._needs_coarse_grids(first)):
            gaits.append(complete_solve(self._start(first)))
            starts = starts[1:] if gaits[0].status.ok else []
        try:
            interrupt = self._solve_coarsest_grids(starts)
        except KeyboardInterrupt:  # between two solves
            interrupt = self._find_latest()
            if interrupt is None:
                raise
        if self._coarse:
            gaits += self._refine_best(interrupt)
        elif interrupt is not None:
            gaits.append(self._interrupt_before_first_start(interrupt))
        return self._report_totals(gaits)

    def _find_latest(self) -> GridSolution | None:
        """Return the last solution on a coarsest grid as an interrupted one; None if there is none."""
        for start in reversed(self._all):
            if start.problem is self._problem and start.latest is not None:
                if all(start is not each for each, _ in self._coarse):
                    self._coarse.append((start, start.latest))
                return mark_interrupted(start.latest)
        return None

    def _interrupt_before_first_start(self, interrupt: GridSolution) -> Gait:
        """Return the line as a gait, if a neighbouring problem was interrupted before the first start."""
        gait = complete_solve(SingleStart(self._problem, LinearGuess(), Ipopt(max_iterations=0), silent))
        return gait.with_failure(Status.INTERRUPTED, interrupt.outcome.message.partition(";")[0])

    def _needs_coarse_grids(self, guess: Guess) -> bool:
        """Return whether the problem is solved on coarse grids first: unless the guess is accurate or a solution."""
        return guess.needs_coarse_grids and guess.solution_for(self._problem.sequence) is None

    def _start(self, guess: Guess) -> SingleStart:
        self._all.append(SingleStart(self._problem, guess, self._solver, self._observer, self._cold_solver))
        return self._all[-1]

    def _solve_coarsest_grids(self, starts: Sequence[Guess | GaitProblem]) -> GridSolution | None:
        """Solve on the coarsest grid from each start unless the first fails; return an interrupted solution."""
        for start in starts:
            guess = self._solve_neighbour(start) if isinstance(start, GaitProblem) else start
            if isinstance(guess, GridSolution):
                return guess
            if guess is None and self._coarse:
                continue
            if self._stop_if_same and guess is not None and self._repeats_first(guess):
                break
            single = self._start(guess or LinearGuess())
            solution = solve_coarsest_grid(single)
            self._coarse.append((single, solution))
            if solution.outcome.status is Status.INTERRUPTED:
                return solution
            if not self._coarse[0][1].outcome.status.ok or (self._stop_if_same and self._first_two_are_same()):
                break
        return None

    def _solve_neighbour(self, problem: GaitProblem) -> Guess | GridSolution | None:
        """Return the solution of a neighbouring problem as a guess, or as it is if interrupted; None if it failed."""
        solver = _neighbour_solver(self._cold_solver)
        start = SingleStart(problem, LinearGuess(), solver, self._observer)
        self._all.append(start)
        solution = solve_coarsest_grid(start)
        if solution.outcome.status is Status.INTERRUPTED:
            return solution
        return FromMotion(solution.motion, problem.name) if solution.outcome.status.ok else None

    def _refine_best(self, interrupt: GridSolution | None) -> list[Gait]:
        """Return the gaits refined from the best different solutions on the coarsest grid, or the first failure."""
        gaits = list[Gait]()
        candidates = self._rank() or [self._coarse[0]]
        lowest = candidates[0][1].cost
        for position, (start, solution) in enumerate(candidates):
            near = solution.cost - lowest <= COST_RANGE * self._scale(lowest)
            if any(gait.status.ok for gait in gaits) and not (near and position < MOST_REFINED):
                break
            if interrupt is not None and solution.outcome.status.ok:
                solution = solution.mark_stopped(interrupt.outcome)
            gaits.append(complete_solve(start, solution))
            self._plans.add(solution, gaits[-1])
            if gaits[-1].status is Status.INTERRUPTED:
                break
        return gaits

    def _rank(self) -> list[tuple[SingleStart, GridSolution]]:
        """Return the different solutions, lowest cost first; of equal ones, that of the first start."""
        different: list[tuple[SingleStart, GridSolution]] = []
        for start, solution in self._coarse:
            if solution.outcome.status.ok and not any(self._are_same(other, solution) for _, other in different):
                different.append((start, solution))
        return sorted(different, key=lambda entry: rank_of(entry[1].cost))

    def _repeats_first(self, guess: Guess) -> bool:
        """Return whether the second of two guesses from motions is nearly the first one."""
        first = self._coarse[0][0].guess if len(self._coarse) == 1 else None
        if not (isinstance(first, FromMotion) and isinstance(guess, FromMotion)):
            return False
        aim = setting(self._problem)
        time = np.linspace(0, aim.period, SAMPLES)
        one, other = first.sample(aim, time), guess.sample(aim, time)
        angles, torques = (
            np.max(np.abs(after - before)) for before, after in ((one.angles, other.angles), (one.torque, other.torque))
        )
        return bool(angles <= NEAR_ANGLES * np.ptp(one.angles) and torques <= NEAR_TORQUES * np.max(np.abs(one.torque)))

    def _first_two_are_same(self) -> bool:
        solutions = [solution for _, solution in self._coarse]
        solved = len(solutions) == 2 and all(solution.outcome.status.ok for solution in solutions)
        return solved and self._are_same(*solutions)

    def _are_same(self, one: GridSolution, other: GridSolution) -> bool:
        durations = [s.outcome.x[s.transcription.variables[Unknown.DURATION][0]] for s in (one, other)]
        return is_same_solution((one.cost, other.cost), (durations[0], durations[1]), self._scale(one.cost))

    def _scale(self, cost: float) -> float:
        return max(abs(cost), NEGLIGIBLE * self._problem.objective.typical)

    def _report_totals(self, gaits: list[Gait]) -> list[Gait]:
        """Return the gaits with the iterations and the time of all starts; if interrupted, only the best one."""
        if len(self._all) == 1 and self._all[0].problem is self._problem:
            return gaits  # whose reports are those of their start
        build = sum(start.build_seconds for start in self._all)
        totals = {
            "iterations": sum(start.iterations for start in self._all),
            "build_seconds": build,
            "solve_seconds": time.perf_counter() - self._began - build,
        }
        return [gait.replace_fields(solver=gait.solver.replace_fields(**totals)) for gait in keep_interrupt(gaits)]


def keep_interrupt(gaits: list[Gait]) -> list[Gait]:
    """Return the gaits of several starts; if the last one was interrupted, only the best, whose status states this."""
    solved = [gait for gait in gaits if gait.status.ok]
    if gaits[-1].status is not Status.INTERRUPTED or not solved:
        return gaits
    best = min(solved, key=lambda gait: rank_of(gait.solver.objective))
    message = f"{gaits[-1].solver.message}; the result is the gait of another start"
    return [best.with_failure(Status.INTERRUPTED, message)]


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
