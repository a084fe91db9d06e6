"""The bound on the spectral radius as the reason of a failure, if a gait without this bound is known."""

import math

import numpy as np
from attrs import evolve

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import Gait
from gaitopt.ocp.bounds import nlp_data, transcribe_problem
from gaitopt.ocp.initial.deviation_start import solve_deviations, spectral_radius
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.conflict_search import SAFETY_FACTOR


def report_radius_conflict(problem: GaitProblem, failure: Gait, unbounded: Gait) -> Gait:
    """Return a failure that names the bound on the spectral radius, with the radius of a gait without this bound.

    Parameters
    ----------
    problem : GaitProblem
    failure : Gait
        Result of a solve that failed; it is returned unchanged if it contains conflicts.
    unbounded : Gait
        The optimal gait without the bound.
    """
    bound = problem.stability
    if bound is None or failure.solver.conflicts or math.isinf(bound.radius):
        return failure
    radius = measure_planned_radius(problem, unbounded)
    if not radius > bound.radius:
        return failure
    conflict = Conflict(
        name="spectral radius",
        setting="StabilityBound.radius",
        limit=bound.radius,
        missing=radius - bound.radius,
        sufficient=bound.radius + SAFETY_FACTOR * (radius - bound.radius),
        unit="1",
        separable=True,
    )
    message = f"{failure.solver.message}; the optimum without the bound has a spectral radius of {radius:.3g}"
    return failure.with_failure(failure.status, message, (conflict,))


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
