"""One solve on one grid, and its result."""

import functools
import math
import time
from dataclasses import asdict, replace

import numpy as np
from attrs import evolve

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.locks import cached_property
from gaitopt.motion.energy import ledger
from gaitopt.motion.gait import BEFORE_REFINEMENT
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.bounds import bounds, nlp_data, transcribe_problem
from gaitopt.ocp.initial.deviation_start import solve_deviations
from gaitopt.ocp.initial.initial_point import point_from_guess
from gaitopt.ocp.initial.solution_transfer import covers_transcription, has_same_grid, transfer_solution
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.feasibility_refinement import refine_feasibility
from gaitopt.ocp.nlp.ipopt import LARGE
from gaitopt.ocp.nlp.keys import Group, Unknown
from gaitopt.ocp.nlp.nlp_solver import Barrier, NlpResult, NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.diagnosis import (
    report_growth,
    report_inaccuracies,
    report_short_phases,
    report_short_steps,
)
from gaitopt.ocp.solution.node_placement import TorqueRamps, read_ramps
from gaitopt.ocp.solution.problem_checks import report_clipped_guess
from gaitopt.ocp.solution.swing_foot_checks import SCUFF, lack_of_height
from gaitopt.ocp.solution.trajectory import (
    BetweenNodes,
    check_between_nodes,
    estimate_growth,
    read_parameters,
    reconstruct_motion,
)
from gaitopt.ocp.solution.transition_checks import report_inconsistent_transitions
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import Observer
from gaitopt.reductions import worst
from gaitopt.status import Status

BARRIER_SAME_PROBLEM, BARRIER_NEARBY_PROBLEM = 1e-6, 1e-4
"""Barrier parameters of a warm start from the same problem on another grid, and from another problem."""

BARRIER_SAME_GRID, BARRIER_COARSE_GRID = (1e-4, 1e-7), (1e-2, 1e-5)
"""Least distance from bounds and least multiplier of a warm start on equal intervals: with other data on the same grid,
and from a coarse grid.

Other bounds are active, and with smaller distances Ipopt would leave the former ones in many small steps.  In 100
random problems on 40 intervals, all solves together take 6 % fewer iterations, and the costs are the same or lower; on
placed nodes, where they are not used, some costs would be up to 0.1 % higher.
"""

COARSE_TOLERANCE = 1e-6
"""Tolerance of Ipopt on the coarse grids of smooth objectives."""

STOPPED_EARLY = (Status.INTERRUPTED, Status.TIME_LIMIT)
"""Statuses after which no further solve is started."""

AT_TOUCHDOWN, REPLAYED = 0.1, 1e-6
"""Least weight of the error after touchdown, which for a usual touchdown is less than ten times the drift, and the
error after touchdown that a replay allows (:class:`gaitopt.Tolerances`)."""

EXACT = 1e-9
"""Error after touchdown below which the growth of errors is not estimated, because it is small."""


@dataclass(frozen=True, eq=False)
class GridSolution:
    """Result of a solve on one grid.

    Attributes
    ----------
    problem : GaitProblem
    method : Method
    transcription : Transcription
    limits : Bounds
    data : (n_z,) array
        Data of the NLP.
    outcome : NlpResult
    kept : bool
        Whether this is a solution whose refinement was stopped; its status then states why.
    """

    problem: GaitProblem
    method: Method
    transcription: Transcription
    limits: Bounds
    data: Array
    outcome: NlpResult
    kept: bool = False

    @property
    def x(self) -> Array:
        """Decision vector with nan and infinity replaced by zero, shape (n_variables,)."""
        return np.nan_to_num(self.outcome.x, nan=0.0, posinf=0.0, neginf=0.0)

    @cached_property
    def cost(self) -> float:
        """Objective of the plan, with the sign changes of the joint powers located in it.

        It differs from the minimised value if the NLP was solved with other sign changes, or with a bound of the
        absolute work.
        """
        nlp, variables, x = self.transcription.nlp, self.transcription.variables, self.outcome.x.copy()
        if self.transcription.sign_changes is None or not np.all(np.isfinite([self.outcome.objective, *x])):
            return self.outcome.objective
        with defer_interrupt():
            data = nlp_data(self.transcription, self.problem, x, exact=True)
            if Unknown.INTEGRAL in variables:  # its row states integrals - unknown = 0
                rows = np.asarray(nlp.derivatives["jac_g"](x, data)[0]).ravel()
                x[variables[Unknown.INTEGRAL]] += rows[self.transcription.constraints[Group.INTEGRAL]]
            return float(nlp.objective(x, data))

    @cached_property
    def ramps(self) -> TorqueRamps | None:
        """The torques along the step, from which nodes are placed; None if the solution is not finite."""
        return read_ramps(self.transcription, self.outcome.x)

    def has_other_sign_changes(self) -> bool:
        """Return whether a solve from this solution would have other data on sign changes."""
        located = self.transcription.locate_sign_changes(self.x)
        used = self.data[self.data.size - located.size :]
        return not np.allclose(located, used, rtol=1e-6, atol=1e-6 * np.max(np.abs(located), initial=0.0))

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name."""
        return read_parameters(self.transcription, self.problem, self.x)

    @cached_property
    def motion(self) -> Motion:
        """The planned step."""
        with defer_interrupt():
            return reconstruct_motion(self.transcription, self.values, self.x)

    @cached_property
    def between(self) -> BetweenNodes:
        """Check of the plan between its nodes."""
        with defer_interrupt():
            return check_between_nodes(self.transcription, self.values, self.x)

    @cached_property
    def error(self) -> float:
        """Largest of the drift between the nodes, the error after touchdown and the error of the energy balance.

        The error after touchdown has a weight with which it satisfies the tolerance if it is at most ten times the
        tolerance and a replay allows it, or if it is at most the tolerance.
        """
        weight = min(max(AT_TOUCHDOWN, self.problem.transcription.tolerance / REPLAYED), 1.0)
        return worst(self.between.drift, weight * self.between.touchdown, ledger(self.motion).relative_residual)

    @property
    def growth(self) -> float:
        """Ratio of the error after the touchdown to an error at the end of a slip; zero if it is not estimated."""
        if self.between.touchdown <= EXACT or math.isinf(self.problem.transcription.tolerance):
            return 0.0
        with defer_interrupt():
            return estimate_growth(self.transcription, self.values, self.x)

    def refine_feasibility(self) -> "GridSolution":
        """Return the solution with its equality constraints satisfied to rounding."""
        outcome = refine_feasibility(self.transcription.nlp, self.outcome, self.data, self.limits)
        return replace(self, outcome=outcome)

    def place_parameters_on_bounds(self) -> "GridSolution":
        """Return the solution with free parameters moved to bounds that they exceed by a solver's tolerance."""
        layout, x = self.transcription.variables, self.x.copy()
        if Unknown.DESIGN not in layout:
            return self
        places = layout[Unknown.DESIGN][:, 0]
        x[places] = np.clip(x[places], self.limits.x_lower[places], self.limits.x_upper[places])
        if np.array_equal(x, self.x):
            return self
        return replace(self, outcome=replace(self.outcome, x=x)).refine_feasibility()

    def mark_stopped(self, refinement: NlpResult) -> "GridSolution":
        """Return the solution with the status of a refinement that was stopped without a result."""
        message = f"{refinement.message.partition('; ')[0]}; {BEFORE_REFINEMENT}"  # not which of its iterates is best
        return replace(self, outcome=replace(self.outcome, status=refinement.status, message=message), kept=True)

    def check_finite(self) -> "GridSolution":
        """Return the solution, with the status of a failure if the plan is not finite between its nodes."""
        if not self.outcome.status.ok or math.isfinite(self.error):
            return self
        message = f"{self.outcome.message}; the plan is not finite between its nodes"
        return replace(self, outcome=replace(self.outcome, status=Status.INVALID_NUMBER, message=message))

    @property
    def drift(self) -> float:
        """Error of the states between nodes; infinite without a solution."""
        known = self.kept or self.outcome.status in (Status.SOLVED, Status.PLAN_INACCURATE)
        return self.between.drift if known else math.inf

    def scuffs(self) -> bool:
        """Return whether the swing foot is too low between the nodes."""
        return lack_of_height(self.transcription, self.problem, self.x) > SCUFF

    @cached_property
    def inaccuracies(self) -> tuple[str, ...]:
        """Sentences that state why the plan is not a motion of the robot between the nodes; empty if it is."""
        transcription, problem = self.transcription, self.problem
        reasons = report_inaccuracies(transcription, problem, self.outcome.x, self.error, self.between)
        with defer_interrupt():
            transitions = report_inconsistent_transitions(problem.robot, transcription.phases, self.motion)
        return reasons + report_growth(self.growth) + transitions

    def check_plan(self) -> "GridSolution":
        """Return the solution, with the status of an inaccurate plan if there is a reason for it."""
        if not self.outcome.status.ok or not self.inaccuracies:
            return self
        return replace(self, outcome=replace(self.outcome, status=Status.PLAN_INACCURATE))

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings of a solution, the inaccuracies of its plan first."""
        if self.outcome.status not in (Status.SOLVED, Status.PLAN_INACCURATE):
            return ()
        arguments = self.transcription, self.problem, self.outcome.x
        return self.inaccuracies + report_short_steps(*arguments) + report_short_phases(*arguments)


@dataclass(frozen=True, eq=False)
class PortableSolution:
    """A solution on one grid that can be sent to another process, which transcribes its problem again.

    Attributes
    ----------
    problem : GaitProblem
    method : Method
    schedule : GuardSchedule or None
    data : (n_z,) array
        Data of the NLP.
    outcome : NlpResult
    kept : bool
        Whether this is a solution whose refinement was stopped.
    """

    problem: GaitProblem
    method: Method
    schedule: GuardSchedule | None
    data: Array
    outcome: NlpResult
    kept: bool

    @classmethod
    def of(cls, solution: GridSolution) -> "PortableSolution":
        """Return a solution of a closed contact sequence without its transcription."""
        schedule = solution.transcription.structure.schedule
        return cls(solution.problem, solution.method, schedule, solution.data, solution.outcome, solution.kept)

    def restore(self) -> GridSolution:
        """Return the solution with its transcription."""
        with defer_interrupt():
            transcription = transcribe_problem(self.problem, self.method, self.schedule)
            limits = bounds(transcription, self.problem)
        return GridSolution(self.problem, self.method, transcription, limits, self.data, self.outcome, self.kept)


class SingleStart:
    """A solve from one start, over several grids, and its iterations and build time.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : NlpSolver
    observer : Observer
    cold_solver : NlpSolver, optional
        Solver of grids without a warm start; `solver` by default.

    Attributes
    ----------
    schedule : GuardSchedule or None
        Schedule of the touchdown guard on the present grid.
    grid_solutions : list of GridSolution
        Solutions on the grids so far, from which the error of the objective is estimated.
    known_factor : float
        Error of the objective per variation of the torques of the gait that the solve is warm-started from, or nan.
    refinements : int
        Number of refinements for the cost so far.
    latest : GridSolution or None
        Solution on the last grid, which remains after an interrupt between two solves.
    """

    def __init__(
        self,
        problem: GaitProblem,
        guess: Guess,
        solver: NlpSolver,
        observer: Observer,
        cold_solver: NlpSolver | None = None,
    ) -> None:
        self.problem, self.guess, self.solver, self.observer = problem, guess, solver, observer
        self.cold_solver = solver if cold_solver is None else cold_solver
        self.iterations, self.build_seconds, self.began = 0, 0.0, time.perf_counter()
        self.schedule: GuardSchedule | None = None
        self.grid_solutions: list[GridSolution] = []
        self.known_factor = math.nan
        self.refinements = 0
        self.latest: GridSolution | None = None

    def describe(self, solution: GridSolution) -> dict[str, object]:
        """Return the entries of the problem's description that the solve determines."""
        structure = solution.transcription.structure
        neighbour = self.guess.neighbour if isinstance(self.guess, WarmStart) else None
        return {
            "guess": self.guess.describe(),
            "neighbour": neighbour and str(neighbour),
            "transcription": solution.method.name,
            "intervals": list(structure.counts),
            "landing": structure.schedule and asdict(structure.schedule),
        }

    def check_guess(self) -> tuple[str, ...]:
        """Return sentences about a guess given by the user that lies outside the bounds."""
        problem = self.problem
        if self.guess is not problem.guess or isinstance(self.guess, WarmStart):
            return ()
        transcription = transcribe_problem(problem, problem.transcription)
        return report_clipped_guess(
            transcription, bounds(transcription, problem), point_from_guess(transcription, problem, self.guess)
        )

    def solve_on_grid(
        self, method: Method, warm_start: Solution | None, barrier: Barrier, *, locate: bool = True
    ) -> GridSolution:
        """Solve on one grid, from a solution or otherwise from the guess.

        The sign changes of the joint powers in a solution on the same grid become data of the NLP if `locate`;
        otherwise the absolute work is bounded from above.  If the guess is a gait, its nodes may have moved, and the
        solver may locate the sign changes again.
        """
        problem = self.problem
        started, misses = time.perf_counter(), transcribe.cache_info().misses
        with defer_interrupt():
            transcription = transcribe_problem(problem, method, self.schedule)
            if transcribe.cache_info().misses > misses:
                self.build_seconds += time.perf_counter() - started
            limits = bounds(transcription, problem)
            if warm_start is not None and covers_transcription(warm_start, transcription):
                x, multipliers = _start_from(warm_start, transcription, np.zeros(transcription.variables.size))
            else:
                guessed = point_from_guess(transcription, problem, self.guess)
                x, multipliers = np.clip(guessed, limits.x_lower, limits.x_upper), None
                if warm_start is not None:
                    x, multipliers = _start_from(warm_start, transcription, x)
        known = self.guess.solution_for(problem.sequence) is not None
        located = locate and warm_start is not None and has_same_grid(warm_start, transcription, moved=known)
        data = nlp_data(transcription, problem, x if located else None)
        if problem.stability is not None:
            x = solve_deviations(transcription, x, data)
        solver = self._choose_solver(method, warm_start)
        update = {"update_data": functools.partial(nlp_data, transcription, problem)} if located and known else {}
        outcome = solver.minimise(transcription.nlp, x, data, limits, self.observer, multipliers, barrier, **update)
        data = data if outcome.data is None else outcome.data
        self.iterations += outcome.iterations
        numbers = (outcome.x, outcome.g, outcome.objective)
        if outcome.status.ok and not all(np.all(np.isfinite(part)) for part in numbers):
            outcome = replace(
                outcome, status=Status.INVALID_NUMBER, message=f"{outcome.message}; the solution contains nan or inf"
            )
        # Without the guess: lazily evaluated results must not keep the gait alive that the solve started from.
        solution = GridSolution(problem.without_guess(), method, transcription, limits, data, outcome)
        self.latest = solution if outcome.status.ok else self.latest
        return solution

    def _choose_solver(self, method: Method, warm_start: Solution | None) -> NlpSolver:
        """Return the solver of a grid; a coarse optimum of a smooth objective is only a start of the next grid."""
        solver = self.cold_solver if warm_start is None else self.solver
        if not isinstance(solver, Newton) or not self.problem.objective.smooth:
            return solver
        if method not in self.problem.transcription.list_grids(self.problem.sequence)[:-1]:
            return solver
        return evolve(solver.fallback, tolerance=max(solver.fallback.tolerance, COARSE_TOLERANCE))


def _start_from(solution: Solution, transcription: Transcription, x: Array) -> tuple[Array, tuple[Array, Array]]:
    """Return the initial point and the multipliers of an NLP from a solution on this or another grid.

    A small NLP on equal intervals starts from values interpolated between the nodes: from an accurate start the solver
    stays in local optima of the coarse grid, whose cost is up to 0.3 % higher in three of the 60 frozen problems.
    """
    placed = solution.fractions is not None or transcription.structure.placed
    return transfer_solution(solution, transcription, x, accurate=placed or transcription.variables.size > LARGE)
