"""First-order prediction of the optimal cost of a perturbed problem."""

import numpy as np
from attrs import evolve

from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, nlp_data, transcribe_problem
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.problem import GaitProblem


def predict_cost(problem: GaitProblem, gait: Gait) -> float:
    """Return the optimal objective of a problem to first order, from an optimal gait of a problem nearby.

    The prediction is the problem's Lagrangian at the gait's unknowns and multipliers (envelope theorem: Nocedal &
    Wright, Numerical Optimization, 12.8).  The two problems may differ in any number: friction, speed, a mass or a
    limit; their phases are equal, and the grid is that of the gait.  For the problem of the gait itself the prediction
    is its objective.

    Parameters
    ----------
    problem : GaitProblem
    gait : Gait
        An optimal gait with its solution.

    Raises
    ------
    InputError
        If the gait has no solution, as one read from a file of an earlier version.
    """
    if gait.solution is None:
        raise InputError(
            "The gait must contain unknowns and Lagrange multipliers, but has none: solve its problem again."
        )
    solution = gait.solution
    method = evolve(problem.transcription, intervals=solution.intervals, fractions=solution.fractions)
    transcription = transcribe_problem(problem, method)
    limits = bounds(transcription, problem)
    x, (on_bounds, on_rows) = transfer_solution(solution, transcription, np.zeros(transcription.variables.size))
    data = nlp_data(transcription, problem, x)
    return evaluate_lagrangian(evaluate_nlp(transcription.nlp, x, data), x, (on_bounds, on_rows), limits)


def evaluate_nlp(nlp: Nlp, x: Array, data: Array) -> tuple[float, Array]:
    """Return the minimised value of an NLP and its rows, shape (n_constraints,)."""
    cost, rows = nlp.values(x, data)
    return float(cost), np.asarray(rows).ravel()


def evaluate_lagrangian(
    values: tuple[float, Array], x: Array, multipliers: tuple[Array, Array], bounds: Bounds
) -> float:
    """Return the Lagrangian: the objective plus multipliers times the excess of unknowns and rows over their bounds.

    Parameters
    ----------
    values : (float, (n_constraints,) array)
        Minimised value and rows at `x`.
    x : (n_variables,) array
    multipliers : (n_variables,), (n_constraints,) arrays
    bounds : Bounds
    """
    (cost, g), (on_bounds, on_rows) = values, multipliers
    return (
        cost
        + _complementarity(on_bounds, x, bounds.x_lower, bounds.x_upper)
        + _complementarity(on_rows, g, bounds.g_lower, bounds.g_upper)
    )


def _complementarity(multipliers: Array, values: Array, lower: Array, upper: Array) -> float:
    """Return the sum of multipliers times excess over the bound: the upper if positive, otherwise the lower."""
    limit = np.where(multipliers > 0, upper, lower)
    finite = np.isfinite(limit)
    return float(multipliers[finite] @ (values[finite] - limit[finite]))
