"""Start of a branch of optimal gaits: a gait, its NLP over the parameter, and its active constraints."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve

from gaitopt.continuation.optimal.active_set_search import find_optimum
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.continuation.optimal.parametric_nlp import find_number, make_parametric_nlp
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method


def start_branch(problem: GaitProblem, name: str, ends: tuple[float, float], gait: Gait) -> KktLinearisation:
    """Return the optimum of a gait on its grid, as a point of the branch over a number of its problem.

    Parameters
    ----------
    problem : GaitProblem
        Problem of the gait at any value of the parameter.
    name : str
        The parameter.
    ends : (float, float)
        Range of the parameter.
    gait : Gait
        Solved; its value of the parameter is the start.

    Raises
    ------
    InputError
        If the gait contains no solution, or is not an optimum whose active constraints are determined.
    """
    gait.require()
    if gait.solution is None:
        raise InputError(
            "The gait must contain unknowns and Lagrange multipliers, but has none: solve its problem again."
        )
    nlp = make_parametric_nlp(problem, name, ends, _find_method(problem, gait), _find_schedule(gait))
    value = find_number(problem, name).value
    x, multipliers = transfer_solution(gait.solution, nlp.transcription, np.zeros(nlp.size))
    optimum = find_optimum(nlp, x, multipliers, value)
    if optimum is None:
        raise InputError(
            f"The active constraints of the optimum at {name} = {value:.6g} are not uniquely determined, so no branch "
            "can start there. Begin the range at another value."
        )
    return optimum


def _find_method(problem: GaitProblem, gait: Gait) -> Method:
    """Return the method by which a gait was solved, with its grid."""
    solution = gait.solution
    method: Method | None = problem.transcription
    recorded = str(gait.problem.get("transcription")).replace(", 1 substeps", ", 1 substep")  # of earlier versions
    while method is not None and method.name != recorded:
        method = method.refine()
    method = problem.transcription if method is None else method
    if solution is None:
        return method
    return evolve(method, intervals=solution.intervals, fractions=solution.fractions, cost_tolerance=np.inf)


def _find_schedule(gait: Gait) -> GuardSchedule | None:
    """Return the schedule of the touchdown guard of a gait."""
    schedule = gait.problem.get("landing")
    return GuardSchedule(**schedule) if schedule else None


def list_samples(ends: tuple[float, float], points: int, start: float) -> Sequence[float]:
    """Return equally spaced values of a range, and that of the start."""
    return sorted({*np.linspace(*ends, points).tolist(), start})
