"""solve_planar: the optimal gait of a planar robot with any contacts."""

import functools
import itertools
import math
import time
from dataclasses import replace

import numpy as np
from attrs import evolve

from gaitopt.arguments import check_arguments
from gaitopt.interrupts import defer_interrupt
from gaitopt.lazy import Deferred
from gaitopt.model.planar.planar_check import require_planar
from gaitopt.motion.gait import SolverReport
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.versions import versions
from gaitopt.ocp.multicontact.coarse_start import solve_from_coarse_grid
from gaitopt.ocp.multicontact.cyclic_coordinates import minimise_without_drift
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.ocp.multicontact.open_sequences import close_problem
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_certification import certify_planar
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility
from gaitopt.ocp.multicontact.planar_infeasibility import RETRY, conclude_planar_failure
from gaitopt.ocp.multicontact.planar_plan import reconstruct_planar_motion
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_refinement import refine_plan
from gaitopt.ocp.multicontact.planar_remarks import report_implausible_limits, report_implausible_robot
from gaitopt.ocp.multicontact.planar_start import planar_start, setting_of, tabulate_solution
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription, transcribe_planar
from gaitopt.ocp.multicontact.planar_warm_start import PlanarWarmStart, find_warm_start, list_refinements
from gaitopt.ocp.multicontact.possible_causes import remark_on_failure
from gaitopt.ocp.multicontact.range_start import solve_from_range_ends
from gaitopt.ocp.multicontact.touchdown_repair import Repair, repair_touchdowns
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.ipopt import MOST_ITERATIONS, Ipopt
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpResult, NlpSolver
from gaitopt.ocp.solution.diagnosis import violations
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.method import check_count
from gaitopt.progress import Iteration, Observer, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

SPREAD_OF_DURATIONS = 0.7
"""Standard deviation of the logarithm of a phase's duration in a further start."""

BARRIER_NEARBY = 1e-4
"""Barrier parameter of a solve that starts near its solution."""

PERTURBATION_NEARBY = 1e4
"""Largest perturbation of the Hessian in a solve that starts near its solution: those that converge need at most 100,
in up to 275 iterations.  Others reach 1e18 by twenty factorisations, each about ten times as slow as usual."""

MOST_NEARBY = 60
"""Largest number of iterations of the solve with fixed durations that starts near its guess."""


@check_arguments
def solve_planar(
    problem: PlanarProblem, *, starts: int = 1, solver: NlpSolver | None = None, observer: Observer = silent
) -> PlanarGait:
    """Find an optimal gait of a planar robot with any contacts.

    The first start is the guess of the problem; the others have random durations of the phases.  If the durations are
    stated by the guess or random, the problem is solved with these durations first.  Points are added to the intervals,
    and then intervals, until the plan is accurate between its nodes, and at most twice more if its replay is predicted
    to fail.  If no start succeeds, the problem is solved from its solution on half as many intervals, and then from a
    motion that satisfies all limits; if the plan is inaccurate and speed or step length have a range, from a gait with
    fixed values in the range.  If the contact sequence leaves modes open, each sequence that it stands for is
    solved from every start; :func:`gaitopt.search` also replays and ranks them.

    Parameters
    ----------
    problem : PlanarProblem
    starts : int
        Number of starts of each contact sequence; the gait of lowest objective is returned.
    solver : Ipopt or Newton, optional
        :class:`gaitopt.Ipopt` by default.
    observer : Observer
        Receives an :class:`gaitopt.progress.Iteration` per iteration.

    Returns
    -------
    PlanarGait
        A numerical failure raises no exception: check ``gait.status``, then replay it by
        :func:`gaitopt.simulation.verify_planar`.

    Raises
    ------
    InputError
        If `starts` is not a whole number of at least 1, or the robot fails its check.

    Examples
    --------
    >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
    >>> from gaitopt.ocp import Collocation, PlanarLimits
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
    ...     objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
    ...     transcription=Collocation(intervals=10)))
    >>> gait.status.key, round(gait.solver.objective, 3)
    ('solved', 2.145)
    """
    check_count("starts", starts, 1, 1000)
    require_planar(problem.robot, problem.parameters)
    solver = solver or Ipopt()
    if isinstance(solver, Ipopt):
        solver = evolve(solver, permute=True)  # rows of several contacts may be nearly dependent
    if isinstance(solver, Newton | Ipopt):
        solver = solver.start_clock()
    closed = [problem] if not problem.sequence.is_open else close_problem(problem)
    reasons = [explain_planar_impossibility(each) for each in closed]
    if all(reasons):
        return _refuse(closed[0], reasons[0] or "", solver)
    closed = [each for each, reason in zip(closed, reasons, strict=True) if reason is None]
    gaits: list[PlanarGait] = []
    for each, number in itertools.product(closed, range(starts)):
        gaits.append(_solve_start(each, number, solver, observer))
        if gaits[-1].status is Status.INTERRUPTED:
            break
    solved = [gait for gait in gaits if gait.status.ok]
    best = min(solved, key=lambda gait: gait.solver.objective) if solved else gaits[-1]
    if gaits[-1].status is Status.INTERRUPTED:
        report = best.solver.replace_fields(message=gaits[-1].solver.message)
        return best.replace_fields(status=Status.INTERRUPTED, solver=report)
    if solved:
        return best
    nearest = min(range(len(gaits)), key=lambda number: rank_of(gaits[number].solver.constraint_violation))
    if not isinstance(solver, Ipopt):
        return gaits[nearest]
    return _solve_again(closed[nearest // starts], gaits[nearest], solver, observer)


def solve_from_guess(problem: PlanarProblem, solver: Ipopt, observer: Observer = silent) -> PlanarGait:
    """Return the result of the first start of :func:`solve_planar` alone: if it fails, no conflict is sought.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    solver : Ipopt
    observer : Observer, optional
    """
    if (reason := explain_planar_impossibility(problem)) is not None:
        return _refuse(problem, reason, solver)
    return _solve_start(problem, 0, evolve(solver, permute=True).start_clock(), observer)


def _solve_again(problem: PlanarProblem, failure: PlanarGait, solver: Ipopt, observer: Observer) -> PlanarGait:
    """Return the gait of another start if all starts have failed: see :func:`solve_planar`; otherwise the failure."""
    solve_once = functools.partial(solve_from_guess, observer=observer)
    if failure.status is Status.PLAN_INACCURATE:
        return remark_on_failure(problem, solve_from_range_ends(problem, failure, solver, solve_once))
    if failure.status not in RETRY:
        return failure
    rescued = solve_from_coarse_grid(problem, solver, solve_once)
    if rescued is not None:
        return rescued if rescued.status.ok else failure.replace_fields(status=rescued.status)
    solve_again = functools.partial(solve_once, solver=solver)
    return remark_on_failure(problem, conclude_planar_failure(problem, failure, solver, observer, solve_again))


class _Start:
    """Solves from one start: counts of iterations and times."""

    def __init__(self, solver: NlpSolver, observer: Observer) -> None:
        self.solver, self.observer = solver, observer
        self.iterations, self.build_seconds, self.started = 0, 0.0, time.perf_counter()
        self.latest: GridResult | None = None
        """Solution on the last grid, which remains after an interrupt between two solves."""
        self.raised: dict[PlanarTranscription, dict[int, float]] = {}
        self._repairs: dict[tuple[GridResult, frozenset[tuple[int, float]]], GridResult] = {}

    def solve(
        self,
        problem: PlanarProblem,
        x: Array | None = None,
        durations: Array | None = None,
        *,
        is_near: bool = False,
        multipliers: tuple[Array, Array] | None = None,
        limit: int = MOST_ITERATIONS,
    ) -> GridResult:
        """Return the solution on the grid of a problem, with fixed durations if they are given.

        If the start is near the solution, the solver begins with a small barrier parameter, so that it stays there, and
        with the multipliers if they are known.
        Ipopt ends after `limit` iterations at the latest.
        """
        transcription = self.transcribe(problem)
        bounds = planar_bounds(transcription, problem)
        if durations is not None:
            places = transcription.variables[Unknown.DURATION][0]
            bounds.x_lower[places] = bounds.x_upper[places] = durations
        if x is None:
            x = planar_start(transcription, problem, durations)
        if multipliers is None and is_near:
            multipliers = np.zeros(x.size), np.zeros(transcription.constraints.size)
        raised = self.raised.get(transcription, {})
        bounds.g_lower[list(raised)] = list(raised.values())
        solver = self.solver
        if isinstance(solver, Ipopt):
            solver = evolve(solver, max_iterations=min(solver.max_iterations, limit))
            solver = solver.limit_perturbation(PERTURBATION_NEARBY) if is_near else solver
        data, intervals = planar_data(problem), sum(problem.counts) if is_near else 0

        def observe(step: Iteration) -> None:
            self.observer(replace(step, intervals=intervals))

        def minimise(initial: Array, within: Bounds, known: tuple[Array, Array] | None) -> NlpResult:
            return solver.minimise(transcription.nlp, initial, data, within, observe, known, BARRIER_NEARBY)

        outcome = minimise_without_drift(minimise, transcription, data, bounds, x, multipliers)
        self.iterations += outcome.iterations
        if outcome.status.ok and not np.all(np.isfinite([*outcome.x, outcome.objective])):
            outcome = replace(outcome, status=Status.INVALID_NUMBER)
        result = GridResult(problem, transcription, bounds, outcome)
        self.latest = result if outcome.status.ok else self.latest
        return result

    def transcribe(self, problem: PlanarProblem) -> PlanarTranscription:
        """Return the NLP of a problem, and count the time that this takes."""
        started = time.perf_counter()
        with defer_interrupt():
            transcription = transcribe_planar(planar_structure(problem))
        self.build_seconds += time.perf_counter() - started
        return transcription

    def resume(self, problem: PlanarProblem, nearby: PlanarWarmStart) -> GridResult | None:
        """Return the final solution that starts from all unknowns and multipliers of a gait; None if none exists."""
        methods = list(list_refinements(problem))[nearby.number :]
        grid = problem.replace(transcription=methods[0])
        transcription = self.transcribe(grid)
        point = nearby.fill(transcription)
        if point is None:
            return None
        if nearby.is_same:
            bounds, clearance = planar_bounds(transcription, grid), grid.limits.clearance
            self.raised[transcription] = nearby.find_raised_rows(transcription, bounds, clearance)
        result = self.solve(grid, point[0], is_near=True, multipliers=point[1], limit=MOST_NEARBY)
        if result.outcome.status.ok:
            result = refine_plan(self, result, methods[1:])
        if result.outcome.status.ok or result.outcome.status is Status.INTERRUPTED:
            return result
        self.raised.clear()  # they depend on a solution that is discarded
        return None

    def exclude_invalid_touchdowns(self, result: GridResult, *, from_below: bool) -> GridResult:
        """Return a solution whose contacts do not close too early or from below, or the last solution before."""
        given = Repair(result, self.raised.get(result.transcription, {}))
        refined = math.isfinite(result.problem.transcription.tolerance)
        repaired = repair_touchdowns(given, self._solve_with_bounds, from_below=from_below, in_stages=refined)
        self.raised[result.transcription] = repaired.rows
        return repaired.result

    def solve_on_finer_grid(self, result: GridResult, method: Collocation, *, from_below: bool) -> GridResult:
        """Return the solution on a finer grid near another one, without invalid touchdowns if possible."""
        guess = FromPlanarGait(_report(result, self))
        finer = self.solve(result.problem.replace(transcription=method, guess=guess), is_near=True)
        return self.exclude_invalid_touchdowns(finer, from_below=from_below)

    def _solve_with_bounds(self, result: GridResult, rows: dict[int, float]) -> GridResult:
        """Return the solution near another one on its grid, with further bounds of its gaps.

        It is stored: if early touchdowns remain, the exclusion of touchdowns from below begins with the same solves.
        """
        self.raised[result.transcription] = rows
        key = result, frozenset(rows.items())
        if key not in self._repairs:
            self._repairs[key] = self.solve(result.problem, result.outcome.x, is_near=True)
        return self._repairs[key]

    def solve_near(self, problem: PlanarProblem, durations: Array) -> GridResult:
        """Return the solution of a problem, which is solved with fixed durations first.

        The solver begins near the guess, with a small barrier parameter.  A guess from which it does not converge in a
        few iterations is poor, and the solver may then leave it.
        """
        near = self.solve(problem, durations=durations, is_near=True, limit=MOST_NEARBY)
        if not near.outcome.status.ok and near.outcome.status is not Status.INTERRUPTED:
            near = self.solve(problem, durations=durations)
        if near.outcome.status is Status.INTERRUPTED:
            return near
        is_near = near.outcome.status.ok
        return self.solve(problem, near.outcome.x if is_near else None, is_near=is_near)


def _solve_start(problem: PlanarProblem, number: int, solver: NlpSolver, observer: Observer) -> PlanarGait:
    """Return the gait found from one start, counted from 0; after an interrupt between two solves, the last one."""
    start = _Start(solver, observer)
    try:
        return _find_gait(problem, number, start)
    except KeyboardInterrupt:
        if start.latest is None:
            raise
        return _report(start.latest.mark_interrupted("User_Requested_Stop"), start)


def _find_gait(problem: PlanarProblem, number: int, start: _Start) -> PlanarGait:
    """Return the gait of a start on a grid on which it is accurate, or where the refinement ended."""
    nearby = find_warm_start(problem) if number == 0 else None
    result = None if nearby is None else start.resume(problem, nearby)
    if result is None:
        durations = _durations(problem, number)
        result = start.solve(problem) if durations is None else start.solve_near(problem, durations)
        result = refine_plan(start, result, list(list_refinements(problem))[1:])
    gait = _report(result, start)
    if result.problem.counts == problem.counts:
        return gait
    return gait.replace_fields(problem=gait.problem | {"stated_intervals": list(problem.counts)})


def _refuse(problem: PlanarProblem, reason: str, solver: NlpSolver) -> PlanarGait:
    """Return the failure of a problem that has no solution, without solving it; or the interrupted evaluation."""
    start = _Start(solver, silent)
    result = start.solve(problem, limit=1)
    if result.outcome.status is Status.INTERRUPTED:
        return _report(result, start)
    failure = _report(replace(result, outcome=replace(result.outcome, status=Status.INFEASIBLE, message=reason)), start)
    return failure.replace_fields(solver=failure.solver.replace_fields(iterations=0, violations=()))


def _durations(problem: PlanarProblem, number: int) -> Array | None:
    """Return the durations with which a start is solved first, or None if they are free from the beginning."""
    setting, guess = setting_of(problem), problem.guess
    if number == 0 and not guess.states_durations:
        return None
    durations = guess.durations(setting)
    if number:
        generator = np.random.default_rng(number)
        changed = durations * np.exp(generator.normal(0, SPREAD_OF_DURATIONS, durations.size))
        durations = changed * durations.sum() / changed.sum()
    targets = (problem.speed_range, problem.step_length_range)
    if all(target.lower == target.upper for target in targets):
        durations = durations * setting.period / durations.sum()
    return np.maximum(durations, problem.limits.shortest_phase)


def _report(result: GridResult, start: _Start) -> PlanarGait:
    """Return the gait of a solution."""
    problem, transcription, outcome = result.problem, result.transcription, result.outcome
    unmet = violations(transcription, result.bounds, outcome.x, outcome.g)
    values = result.values
    return PlanarGait(
        robot=problem.robot,
        sequence=problem.sequence,
        status=outcome.status,
        motion=Deferred(lambda: reconstruct_planar_motion(transcription, values, outcome.x)),
        problem=problem.describe(),
        solver=SolverReport(
            iterations=start.iterations,
            objective=outcome.objective,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=Deferred(lambda: result.error),
            cost_error=result.cost_error,
            build_seconds=start.build_seconds,
            solve_seconds=time.perf_counter() - start.started - start.build_seconds,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=(
                *report_implausible_robot(problem, values),
                *report_implausible_limits(problem),
                *result.warnings,
            ),
        ),
        versions=versions(),
        solution=tabulate_solution(transcription, outcome.x, outcome.multipliers, outcome.g),
        certificate=Deferred(lambda: certify_planar(problem, transcription, result.bounds, outcome)),
    )
