"""One attempt at a gait: from one start through coarse grids to a plan that is accurate between its nodes."""

import functools
import math
import time
from dataclasses import asdict, dataclass, replace

import numpy as np

from gaitopt.later import Deferred
from gaitopt.motion.energy import ledger
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.solution import Solution
from gaitopt.motion.versions import versions
from gaitopt.ocp.bounds import Bounds, bounds, data_vector, structure
from gaitopt.ocp.carrying import carried, is_complete, solution_of
from gaitopt.ocp.diagnosis import ROUNDING, violations, warnings
from gaitopt.ocp.going_on import Continued
from gaitopt.ocp.guess import Guess
from gaitopt.ocp.ipopt import STOPPED
from gaitopt.ocp.landing import Landing, shifted
from gaitopt.ocp.method import Method
from gaitopt.ocp.outcome import Minimiser, Outcome
from gaitopt.ocp.polish import polished
from gaitopt.ocp.presolve import moved_inside, poorly_scaled
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.readout import Between, between_nodes, found_values, read_motion
from gaitopt.ocp.start import guessed, start
from gaitopt.ocp.swing import SCUFF, early_touchdown, lack_of_height
from gaitopt.ocp.tap import undivided
from gaitopt.ocp.transcription import Transcription, transcribe
from gaitopt.progress import Observer
from gaitopt.status import Status

MOST_DOUBLINGS = 2
"""Grids are doubled so often for a contact mode that is violated between the points at which it is held."""

MOST_LANDINGS = 3
"""A plan that touches down early is solved so often again with its touchdown kept from that."""

GAIN = 1e-4
"""Share of the objective for which the node at which the touchdown is armed is moved further."""

SAME, NEAR = 1e-6, 1e-5
"""Barrier parameters to go on with from the same problem on another grid, and from another problem."""


@dataclass(frozen=True, eq=False)
class Step:
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
    outcome: Outcome
    kept: bool = False

    @property
    def x(self) -> Array:
        """Decision vector, finite whatever the solver left, shape (n_variables,)."""
        return np.nan_to_num(self.outcome.x, nan=0.0, posinf=0.0, neginf=0.0)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name."""
        return found_values(self.transcription, self.problem, self.x)

    @functools.cached_property
    def motion(self) -> Motion:
        """The planned step."""
        with undivided():
            return read_motion(self.transcription, self.values, self.x)

    @functools.cached_property
    def between(self) -> Between:
        """What the plan does between its nodes."""
        with undivided():
            return between_nodes(self.transcription, self.values, self.x)

    @functools.cached_property
    def error(self) -> float:
        """Drift between the nodes or closing error of the energy ledger, whichever is larger."""
        return max(self.between.drift, ledger(self.motion).relative_residual)

    def polished(self) -> "Step":
        """Return the step with its equations met to rounding."""
        outcome = polished(self.transcription.nlp, self.outcome, data_vector(self.problem), self.limits)
        return replace(self, outcome=outcome)

    def stopped(self, later: Outcome) -> "Step":
        """Return the step with the status of a later one that was stopped before it got anywhere."""
        message = f"{later.message}; kept is the solution before this refinement"
        return replace(self, outcome=replace(self.outcome, status=later.status, message=message), kept=True)

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


class Attempt:
    """A solve in progress: counts what it costs.

    Parameters
    ----------
    problem : GaitProblem
    guess : Guess
    solver : Minimiser
    observer : Observer
    """

    def __init__(self, problem: GaitProblem, guess: Guess, solver: Minimiser, observer: Observer) -> None:
        self.problem, self.guess, self.solver, self.observer = problem, guess, solver, observer
        self.iterations, self.build_seconds = 0, 0.0
        self.landing: Landing | None = None

    def found(self, step: Step) -> dict[str, object]:
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
        if self.guess is not problem.guess or isinstance(self.guess, Continued):
            return ()
        transcription = transcribe(structure(problem, problem.transcription))
        return moved_inside(transcription, bounds(transcription, problem), guessed(transcription, problem, self.guess))

    def run(self, method: Method, before: Solution | None, barrier: float) -> Step:
        """Solve on one grid, from a solution or else from the guess."""
        problem = self.problem
        began, known = time.perf_counter(), transcribe.cache_info().misses
        with undivided():
            transcription = transcribe(structure(problem, method, landing=self.landing))
            if transcribe.cache_info().misses > known:
                self.build_seconds += time.perf_counter() - began
            if before is not None and is_complete(before, transcription):
                x, multipliers = carried(before, transcription, np.zeros(transcription.variables.size))
            else:
                x, multipliers = start(transcription, problem, self.guess), None
                if before is not None:
                    x, multipliers = carried(before, transcription, x)
        limits, data = bounds(transcription, problem), data_vector(problem)
        outcome = self.solver.minimise(transcription.nlp, x, data, limits, self.observer, multipliers, barrier)
        self.iterations += outcome.iterations
        return Step(problem, method, transcription, limits, outcome)

    def landed(self, step: Step, landing: Landing) -> Step:
        """Solve again from a solution, its touchdown held to a landing; the solution is kept if that is interrupted."""
        self.landing = landing
        later = _refined(self, self.run(step.method, solution_of(step.transcription, step.outcome), NEAR))
        interrupted = later.outcome.status in (Status.INTERRUPTED, Status.TIME_LIMIT)
        return step.stopped(later.outcome) if interrupted else later


def attempt(problem: GaitProblem, guess: Guess, solver: Minimiser, observer: Observer) -> Gait:
    """Solve from one start."""
    began, own = time.perf_counter(), Attempt(problem, guess, solver, observer)
    step = _landed(own, _refined(own, _approached(own)))
    transcription, outcome, remarks = step.transcription, step.outcome, own.remarks()
    if not outcome.status.ok:
        remarks += poorly_scaled(transcription, start(transcription, problem, guess), data_vector(problem))
    unmet = violations(transcription, step.limits, outcome.x, outcome.g)
    # Without a tolerance nothing has been looked at between the nodes; that can wait until somebody asks.
    return Gait(
        robot=problem.robot.name,
        word=problem.word,
        status=outcome.status,
        motion=Deferred(lambda: step.motion),
        problem=problem.describe() | own.found(step),
        solver=SolverReport(
            iterations=own.iterations,
            objective=outcome.objective,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=Deferred(step.drift),
            build_seconds=own.build_seconds,
            solve_seconds=time.perf_counter() - began - own.build_seconds,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=Deferred(lambda: remarks + step.warnings()),
        ),
        versions=versions(),
        solution=solution_of(transcription, outcome),
    )


def _approached(own: Attempt) -> Step:
    """Return the solution on the problem's own grid, found through coarser ones."""
    problem, guess = own.problem, own.guess
    path, before, barrier = problem.transcription.approach(problem.word), None, SAME
    known = guess.solution_for(problem.word)
    if known is not None:
        path, before, barrier = path[-1:], known, NEAR
    step = None
    for method in path:
        last, step = step, own.run(method, before, barrier)
        if step.outcome.status in STOPPED and last is not None:
            return last.stopped(step.outcome)
        if step.outcome.status in (Status.INTERRUPTED, Status.TIME_LIMIT):
            return step
        if not step.outcome.status.ok:
            break
        before = solution_of(step.transcription, step.outcome)
        # On another grid a swing foot rests on its least height at other points.
        barrier = SAME if problem.limits.clearance is None else NEAR
    assert step is not None
    if step.outcome.status.ok or len(path) == 1:
        return step
    return own.run(path[-1], None, SAME)  # the coarse grid has misled


def _refined(own: Attempt, step: Step) -> Step:
    """Return the solution once it is accurate enough, or refinement ends."""
    problem, doublings = own.problem, MOST_DOUBLINGS
    tolerance = problem.transcription.tolerance
    while step.outcome.status.ok and math.isfinite(tolerance):
        if step.error > tolerance:
            step = step.polished()
        finer, rough = None, step.error > tolerance
        if rough:
            finer = step.method.finer()
        if finer is None and doublings and (rough or step.between.outside > ROUNDING or step.scuffs()):
            finer, doublings = step.method.doubled(problem.word), doublings - 1
        if finer is None:
            break
        last, step = step, own.run(finer, solution_of(step.transcription, step.outcome), SAME)
        if step.outcome.status in STOPPED:
            return last.stopped(step.outcome)
    return step


def _landed(own: Attempt, step: Step) -> Step:
    """Return a solution that does not touch down before its end, where one is found nearby."""
    tries = MOST_LANDINGS if math.isfinite(own.problem.transcription.tolerance) else 0
    for number in range(tries):
        early = early_touchdown(step.transcription, own.problem, step.x) if step.outcome.status.ok else None
        if early is None:
            break
        later = own.landed(step, replace(early.landing, least=early.landing.least * 4**number))
        if later.kept or not later.outcome.status.ok:
            return later if later.kept else step
        step = later
    return _armed_in_time(own, step)


def _armed_in_time(own: Attempt, step: Step) -> Step:
    """Return the cheapest solution nearby whose touchdown is armed at another node, where there is a choice."""
    for side in (-1, 1):
        while landing := shifted(step.transcription.phases, step.transcription.structure.landing, side):
            later = own.landed(step, landing)
            if later.kept:
                return later
            gained = step.outcome.objective - later.outcome.objective
            if not later.outcome.status.ok or gained <= GAIN * abs(step.outcome.objective):
                break
            if early_touchdown(later.transcription, own.problem, later.x) is not None:
                break
            step = later
    return step
