"""One solve on one grid, and its result."""

import functools
import math
import time
from dataclasses import asdict, dataclass, replace

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.energy import ledger
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.solution import Solution
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point, point_from_guess
from gaitopt.ocp.initial.solution_transfer import covers_transcription, transfer_solution
from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.feasibility_refinement import refine_feasibility
from gaitopt.ocp.nlp.nlp_solver import NlpResult, NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.diagnosis import warnings
from gaitopt.ocp.solution.problem_checks import report_clipped_guess
from gaitopt.ocp.solution.swing_foot_checks import SCUFF, lack_of_height
from gaitopt.ocp.solution.trajectory import BetweenNodes, check_between_nodes, read_motion, read_parameters
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


@dataclass(frozen=True, eq=False)
class GridSolution:
    """Result of a solve on one grid.

    Attributes
    ----------
    problem : GaitProblem
    method : Method
    transcription : Transcription
    limits : Bounds
    outcome : NlpResult
    kept : bool
        Whether this is a solution whose refinement was stopped; its status then states why.
    """

    problem: GaitProblem
    method: Method
    transcription: Transcription
    limits: Bounds
    outcome: NlpResult
    kept: bool = False

    @property
    def x(self) -> Array:
        """Decision vector with nan and infinity replaced by zero, shape (n_variables,)."""
        return np.nan_to_num(self.outcome.x, nan=0.0, posinf=0.0, neginf=0.0)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name."""
        return read_parameters(self.transcription, self.problem, self.x)

    @functools.cached_property
    def motion(self) -> Motion:
        """The planned step."""
        with defer_interrupt():
            return read_motion(self.transcription, self.values, self.x)

    @functools.cached_property
    def between(self) -> BetweenNodes:
        """Check of the plan between its nodes."""
        with defer_interrupt():
            return check_between_nodes(self.transcription, self.values, self.x)

    @functools.cached_property
    def error(self) -> float:
        """Larger of the drift between the nodes and the relative error of the energy balance."""
        return worst(self.between.drift, ledger(self.motion).relative_residual)

    def refine_feasibility(self) -> "GridSolution":
        """Return the solution with its equality constraints satisfied to rounding."""
        outcome = refine_feasibility(self.transcription.nlp, self.outcome, data_vector(self.problem), self.limits)
        return replace(self, outcome=outcome)

    def mark_stopped(self, refinement: NlpResult) -> "GridSolution":
        """Return the solution with the status of a refinement that was stopped without a result."""
        message = f"{refinement.message}; the result is the solution before this refinement"
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
        return self.between.drift if self.outcome.status.ok or self.kept else math.inf

    def scuffs(self) -> bool:
        """Return whether the swing foot is too low between the nodes."""
        return lack_of_height(self.transcription, self.problem, self.x) > SCUFF

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings of a solution."""
        if not self.outcome.status.ok:
            return ()
        return warnings(self.transcription, self.problem, self.outcome.x, self.error, self.between.outside)


class SingleStart:
    """A solve from one start, over several grids, and its iterations and build time.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : NlpSolver
    observer : Observer
    scout : NlpSolver, optional
        Solver of grids without a warm start; `solver` by default.
    """

    def __init__(
        self,
        problem: GaitProblem,
        guess: Guess,
        solver: NlpSolver,
        observer: Observer,
        scout: NlpSolver | None = None,
    ) -> None:
        self.problem, self.guess, self.solver, self.observer = problem, guess, solver, observer
        self.scout = solver if scout is None else scout
        self.iterations, self.build_seconds = 0, 0.0
        self.schedule: GuardSchedule | None = None

    def describe(self, solution: GridSolution) -> dict[str, object]:
        """Return the entries of the problem's description that the solve determines."""
        structure = solution.transcription.structure
        return {
            "guess": self.guess.describe(),
            "transcription": solution.method.name,
            "intervals": list(structure.counts),
            "landing": structure.schedule and asdict(structure.schedule),
        }

    def check_guess(self) -> tuple[str, ...]:
        """Return sentences about a guess given by the user that lies outside the bounds."""
        problem = self.problem
        if self.guess is not problem.guess or isinstance(self.guess, WarmStart):
            return ()
        transcription = transcribe(structure(problem, problem.transcription))
        return report_clipped_guess(
            transcription, bounds(transcription, problem), point_from_guess(transcription, problem, self.guess)
        )

    def solve_on_grid(self, method: Method, warm_start: Solution | None, barrier: float) -> GridSolution:
        """Solve on one grid, from a solution or otherwise from the guess."""
        problem = self.problem
        started, misses = time.perf_counter(), transcribe.cache_info().misses
        with defer_interrupt():
            transcription = transcribe(structure(problem, method, schedule=self.schedule))
            if transcribe.cache_info().misses > misses:
                self.build_seconds += time.perf_counter() - started
            if warm_start is not None and covers_transcription(warm_start, transcription):
                x, multipliers = transfer_solution(warm_start, transcription, np.zeros(transcription.variables.size))
            else:
                x, multipliers = initial_point(transcription, problem, self.guess), None
                if warm_start is not None:
                    x, multipliers = transfer_solution(warm_start, transcription, x)
        limits, data = bounds(transcription, problem), data_vector(problem)
        solver = self.scout if warm_start is None else self.solver
        outcome = solver.minimise(transcription.nlp, x, data, limits, self.observer, multipliers, barrier)
        self.iterations += outcome.iterations
        if outcome.status.ok and not np.all(np.isfinite([*outcome.x, *outcome.g, outcome.objective])):
            outcome = replace(outcome, status=Status.INVALID_NUMBER, message=f"{outcome.message}, at nan or inf")
        # Without the guess: lazily evaluated results must not keep the gait alive that the solve started from.
        return GridSolution(problem.without_guess(), method, transcription, limits, outcome)
