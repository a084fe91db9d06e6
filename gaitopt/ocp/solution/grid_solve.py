"""One run of the solver on one grid, and what it found."""

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
from gaitopt.ocp.solution.trajectory import BetweenNodes, check_between_nodes, read_motion, solved_parameters
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import Observer
from gaitopt.reductions import worst
from gaitopt.status import Status

BARRIER_SAME_PROBLEM, BARRIER_NEARBY_PROBLEM = 1e-6, 1e-4
"""Barrier parameters to go on with from the same problem on another grid, and from another problem."""


@dataclass(frozen=True, eq=False)
class GridSolution:
    """What was found on one grid.

    Attributes
    ----------
    problem : GaitProblem
    method : Method
    transcription : Transcription
    limits : Bounds
    outcome : Outcome
    kept : bool
        Whether this is a solution whose refinement was stopped, which its status then tells.
    """

    problem: GaitProblem
    method: Method
    transcription: Transcription
    limits: Bounds
    outcome: NlpResult
    kept: bool = False

    @property
    def x(self) -> Array:
        """Decision vector, finite whatever the solver left, shape (n_variables,)."""
        return np.nan_to_num(self.outcome.x, nan=0.0, posinf=0.0, neginf=0.0)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name."""
        return solved_parameters(self.transcription, self.problem, self.x)

    @functools.cached_property
    def motion(self) -> Motion:
        """The planned step."""
        with defer_interrupt():
            return read_motion(self.transcription, self.values, self.x)

    @functools.cached_property
    def between(self) -> BetweenNodes:
        """What the plan does between its nodes."""
        with defer_interrupt():
            return check_between_nodes(self.transcription, self.values, self.x)

    @functools.cached_property
    def error(self) -> float:
        """Drift between the nodes or closing error of the energy ledger, whichever is larger."""
        return worst(self.between.drift, ledger(self.motion).relative_residual)

    def polished(self) -> "GridSolution":
        """Return the step with its equations met to rounding."""
        outcome = refine_feasibility(self.transcription.nlp, self.outcome, data_vector(self.problem), self.limits)
        return replace(self, outcome=outcome)

    def stopped(self, later: NlpResult) -> "GridSolution":
        """Return the step with the status of a later one that was stopped before it got anywhere."""
        message = f"{later.message}; kept is the solution before this refinement"
        return replace(self, outcome=replace(self.outcome, status=later.status, message=message), kept=True)

    def reject_unsound(self) -> "GridSolution":
        """Return the step, as a failure if a solution is not finite between its nodes: no motion passes there."""
        if not self.outcome.status.ok or math.isfinite(self.error):
            return self
        message = f"{self.outcome.message}; the plan is not finite between its nodes"
        return replace(self, outcome=replace(self.outcome, status=Status.INVALID_NUMBER, message=message))

    def drift(self) -> float:
        """Return the error between nodes; infinite where there is no solution."""
        return self.between.drift if self.outcome.status.ok or self.kept else math.inf

    def scuffs(self) -> bool:
        """Return whether the swing foot is too low between the nodes."""
        return lack_of_height(self.transcription, self.problem, self.x) > SCUFF

    def warnings(self) -> tuple[str, ...]:
        """Return what in a solution deserves a look."""
        if not self.outcome.status.ok:
            return ()
        return warnings(self.transcription, self.problem, self.outcome.x, self.error, self.between.outside)


class SingleStart:
    """A solve in progress: counts what it costs.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : NlpSolver
    observer : Observer
    """

    def __init__(self, problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: Observer) -> None:
        self.problem, self.guess, self.solver, self.observer = problem, guess, solver, observer
        self.iterations, self.build_seconds = 0, 0.0
        self.landing: GuardSchedule | None = None

    def found(self, step: GridSolution) -> dict[str, object]:
        """Return what of the problem's description the solve has decided."""
        solved = step.transcription.structure
        return {
            "guess": self.guess.describe(),
            "transcription": step.method.name,
            "intervals": list(solved.counts),
            "landing": solved.landing and asdict(solved.landing),
        }

    def remarks(self) -> tuple[str, ...]:
        """Return what is odd about the user's own guess."""
        problem = self.problem
        if self.guess is not problem.guess or isinstance(self.guess, WarmStart):
            return ()
        transcription = transcribe(structure(problem, problem.transcription))
        return report_clipped_guess(
            transcription, bounds(transcription, problem), point_from_guess(transcription, problem, self.guess)
        )

    def run(self, method: Method, before: Solution | None, barrier: float) -> GridSolution:
        """Solve on one grid, from a solution or else from the guess."""
        problem = self.problem
        began, known = time.perf_counter(), transcribe.cache_info().misses
        with defer_interrupt():
            transcription = transcribe(structure(problem, method, landing=self.landing))
            if transcribe.cache_info().misses > known:
                self.build_seconds += time.perf_counter() - began
            if before is not None and covers_transcription(before, transcription):
                x, multipliers = transfer_solution(before, transcription, np.zeros(transcription.variables.size))
            else:
                x, multipliers = initial_point(transcription, problem, self.guess), None
                if before is not None:
                    x, multipliers = transfer_solution(before, transcription, x)
        limits, data = bounds(transcription, problem), data_vector(problem)
        outcome = self.solver.minimise(transcription.nlp, x, data, limits, self.observer, multipliers, barrier)
        self.iterations += outcome.iterations
        if outcome.status.ok and not np.all(np.isfinite([*outcome.x, *outcome.g, outcome.objective])):
            outcome = replace(outcome, status=Status.INVALID_NUMBER, message=f"{outcome.message}, at nan or inf")
        # Without its guess: what is read out of a step later must not keep the gait alive from which it went on.
        return GridSolution(problem.without_guess(), method, transcription, limits, outcome)
