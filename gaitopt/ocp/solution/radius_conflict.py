"""The bound on the spectral radius as the reason of a failure, if a gait without this bound is known."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from attrs import evolve

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import nlp_data, transcribe_problem
from gaitopt.ocp.initial.deviation_start import solve_deviations, spectral_radius
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.nlp.elastic import ElasticResult
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.conflict_search import SAFETY_FACTOR, elastic_solver
from gaitopt.ocp.solution.feasibility import ElasticProblem
from gaitopt.ocp.solution.mesh_refinement import find_coarsest_grid
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart
from gaitopt.progress import Observer
from gaitopt.status import Status


def report_radius_conflict(problem: GaitProblem, failure: Gait, unbounded: Gait) -> Gait:
    """Return a failure that names the bound on the spectral radius, with the radius of a gait without this bound.

    Parameters
    ----------
    problem : GaitProblem
    failure : Gait
        Result of a solve that failed; it is returned unchanged if it contains limits that suffice alone.  Otherwise
        the bound on the spectral radius, which suffices alone, replaces limits that suffice only together.
    unbounded : Gait
        The optimal gait without the bound.
    """
    bound = problem.stability
    if bound is None or math.isinf(bound.radius) or any(limit.separable for limit in failure.solver.conflicts):
        return failure
    radius = measure_planned_radius(problem, unbounded)
    if not radius > bound.radius:
        return failure
    message = f"{failure.solver.message}; the optimum without the bound has a spectral radius of {radius:.3g}"
    return failure.with_failure(failure.status, message, (_record_radius(bound.radius, radius, separable=True),))


def _record_radius(limit: float, radius: float, *, separable: bool) -> Conflict:
    """Return the record of a bound on the spectral radius that a motion exceeds."""
    return Conflict(
        name="spectral radius",
        setting="StabilityBound.radius",
        limit=limit,
        missing=radius - limit,
        sufficient=limit + SAFETY_FACTOR * (radius - limit),
        unit="1",
        separable=separable,
    )


def check_conflicts_with_radius(
    problem: GaitProblem, failure: Gait, guesses: Sequence[Guess], solver: NlpSolver, observer: Observer
) -> Gait:
    """Return a failure of a problem without its bound on the spectral radius, with the conflicts under the bound.

    Each limit that suffices alone without the bound is relaxed further, until the bound is met as well.  If this is
    possible for none of them, the first limit and the spectral radius suffice together.  Limits that were not
    examined with the bound are returned with the statement that the problem has no gait even without it.

    Parameters
    ----------
    problem : GaitProblem
        The problem with the bound.
    failure : Gait
        Its result without the bound, with conflicts.
    guesses : sequence of Guess
        Those near which the motion of least excess is sought.
    solver : NlpSolver
    observer : Observer
    """
    bound, conflicts = problem.stability, failure.solver.conflicts
    if bound is None or math.isinf(bound.radius):
        return failure
    limits: tuple[Conflict, ...] = ()
    try:
        if conflicts and conflicts[0].separable:
            limits = _relax_with_bound(problem, conflicts, guesses, solver, observer)
    except KeyboardInterrupt:
        return failure.with_failure(Status.INTERRUPTED, "User_Requested_Stop")
    message = failure.solver.message
    if not limits or not limits[0].separable:
        message += ", even without the bound on the spectral radius"
    return failure.with_failure(failure.status, message, limits or conflicts)


def _relax_with_bound(
    problem: GaitProblem,
    conflicts: tuple[Conflict, ...],
    guesses: Sequence[Guess],
    solver: NlpSolver,
    observer: Observer,
) -> tuple[Conflict, ...]:
    """Return the limits that suffice alone if the bound is met, otherwise the first one together with the bound.

    If no elastic solve finds such a limit, gaits without one of the limits are sought.  The result may be empty.
    """
    limit = problem.stability.radius if problem.stability else math.inf
    grid, elastic = find_coarsest_grid(problem), elastic_solver(solver, len(problem.sequence.phases))
    unbounded = ElasticProblem(problem.replace(stability=None), grid, elastic, observer)
    bounded = ElasticProblem(problem, grid, elastic, observer)
    nearest = [result for guess in guesses if (result := _require_end(unbounded.minimise_excess(guess))).status.ok]
    starts: dict[int, Array] = {}
    joint: tuple[Conflict, ...] = ()
    for conflict in conflicts if nearest else ():
        near, number = min(nearest, key=unbounded.excess), _find_limit(unbounded, conflict)
        alone = _require_end(unbounded.exceed_only([number], near.x, near.multipliers))
        if not unbounded.suffices(number, alone):
            continue
        x = bounded.start_near(FromMotion(unbounded.motion(alone)))
        starts[_find_limit(bounded, conflict)] = x
        radius = float(x[bounded.transcription.variables[Unknown.RADIUS]].item())
        if not joint and radius > limit:
            joint = (replace(conflict, separable=False), _record_radius(limit, radius, separable=False))
    separable = tuple(
        bounded.record_conflict(number, result, separable=True)
        for number, result in _relax_each(bounded, starts).items()
        if bounded.suffices(number, result)
    )
    if separable:
        return separable
    exceeded = (_solve_without(problem, each, guesses[0], solver, observer) for each in conflicts)
    return tuple(conflict for conflict in exceeded if conflict is not None) or joint


def _solve_without(
    problem: GaitProblem, conflict: Conflict, guess: Guess, solver: NlpSolver, observer: Observer
) -> Conflict | None:
    """Return a conflict with the value of its limit in a gait without this limit; None if no such gait is found."""
    limits = problem.limits
    if conflict.setting in ("speed", "step_length"):
        relaxed = problem.replace(**{conflict.setting: None})
    elif conflict.setting == "Limits.torque":
        torques = dict(zip(problem.robot.actuators, limits.torques(problem.robot.actuators), strict=True))
        relaxed = problem.replace(limits=evolve(limits, torque={**torques, conflict.item: math.inf}))
    else:
        return None
    gait = solve_from_start(relaxed.replace(stability=None), guess, solver, observer)
    gait = solve_from_start(relaxed, WarmStart(gait), solver, observer) if gait.status.ok else gait
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if not gait.status.ok:
        return None
    if conflict.setting == "Limits.torque":
        row = problem.robot.actuators.index(conflict.item)
        value = max(float(np.max(np.abs(segment.torque[row]))) for segment in gait.motion.segments)
    else:
        value = gait.speed if conflict.setting == "speed" else gait.step_length
    return replace(conflict, missing=abs(value - conflict.limit), sufficient=value, separable=True)


def _relax_each(bounded: ElasticProblem, starts: dict[int, Array]) -> dict[int, ElasticResult]:
    """Return the motion that exceeds each limit, and if possible no others, by the number of the limit.

    A solve that does not converge is repeated from the motions of other limits.
    """
    results = {number: _require_end(bounded.exceed_only([number], x)) for number, x in starts.items()}
    converged = [result for result in results.values() if result.status.ok]
    for number, result in results.items():
        others = iter(() if result.status.ok else converged)
        while not bounded.suffices(number, results[number]) and (other := next(others, None)):
            results[number] = _require_end(bounded.exceed_only([number], other.x, other.multipliers))
    return results


def _require_end(result: ElasticResult) -> ElasticResult:
    """Return a result; raise KeyboardInterrupt if it was interrupted."""
    if result.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return result


def _find_limit(elastic: ElasticProblem, conflict: Conflict) -> int:
    """Return the number of the limit of a conflict."""
    names = [(limit.name, limit.setting) for limit in elastic.limits]
    return names.index((conflict.name, conflict.setting))


@defer_interrupt()
def measure_planned_radius(problem: GaitProblem, gait: Gait) -> float:
    """Return the spectral radius of a gait in the NLP of a problem, without feedback; nan if unknown."""
    solution = gait.solution
    if solution is None:
        return math.nan
    method = evolve(problem.transcription, intervals=solution.intervals, fractions=solution.fractions)
    transcription = transcribe_problem(problem, method)
    x, _ = transfer_solution(solution, transcription, np.zeros(transcription.variables.size))
    return spectral_radius(transcription, solve_deviations(transcription, x, nlp_data(transcription, problem, x)))
