"""Refinement of feasibility: the equality constraints of a solution satisfied to rounding.

A solver satisfies them to its tolerance only.  An unstable walker amplifies this residual within one step, by 1e5 and
more for five links, so the open-loop replay of an otherwise accurate optimum can miss its touchdown.
"""

import math
from dataclasses import replace

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.nlp.sparse_matrix import SparseMatrix, factorise

CORRECTIONS = 3
"""Largest number of Newton steps; each squares the residual."""

AT_BOUND = 1e-7
"""Distance from a bound within which the bound is active; Ipopt leaves 1e-8 to either side."""

NEGLIGIBLE = 1e-12
"""Regularisation of the equations, which admits dependent ones."""


def refine_feasibility(nlp: Nlp, outcome: NlpResult, data: Array, bounds: Bounds) -> NlpResult:
    """Return the solution with the least correction that satisfies its equality constraints; active bounds stay active.

    Parameters
    ----------
    nlp : Nlp
    outcome : NlpResult
        A solution.
    data : (n_z,) array
    bounds : Bounds
    """
    equal = bounds.g_lower == bounds.g_upper
    best, x = math.inf, outcome.x
    for _ in range(CORRECTIONS + 1):
        g, jacobian = nlp.derivatives["jac_g"](x, data)
        values = np.asarray(g).ravel()
        unmet = (bounds.g_lower - values)[equal]
        if not np.abs(unmet).max(initial=0.0) < best:
            break
        best = np.abs(unmet).max(initial=0.0)
        outcome = replace(outcome, x=x, g=values, objective=float(nlp.derivatives["grad_f"](x, data)[0]))
        free = np.minimum(x - bounds.x_lower, bounds.x_upper - x) > AT_BOUND
        rows = SparseMatrix.read(jacobian).select(equal, free)
        right = np.concatenate([np.zeros(rows.shape[1]), unmet])
        correction = factorise(rows, NEGLIGIBLE, corrections=2)(right[:, None])[: rows.shape[1], 0]
        x = x.copy()
        x[free] += correction
    return outcome
