"""The last digits: a solution's equations met to rounding, which a solver leaves met to its tolerance.

An unstable walker multiplies what is left of them within one step, by 1e5 and more for five links, so that a plan can
be optimal to all digits that matter and yet miss its own touchdown when its torques are played back.
"""

import math
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import NlpResult

CORRECTIONS = 3
"""Newton steps; each squares what is left."""

AT_BOUND = 1e-7
"""Distance of what rests on a bound; Ipopt leaves it 1e-8 to either side."""

NEGLIGIBLE = 1e-12
"""Weight of equations against corrections: lets equations that repeat others be."""


def refine_feasibility(nlp: Nlp, outcome: NlpResult, data: Array, bounds: Bounds) -> NlpResult:
    """Return a solution moved by the least that meets its equality constraints; what rests on a bound stays there.

    Parameters
    ----------
    nlp : Nlp
    outcome : Outcome
        A solution.
    data : (n_z,) array
    bounds : Bounds
    """
    equal = np.flatnonzero(bounds.g_lower == bounds.g_upper)
    best, x = math.inf, outcome.x
    for _ in range(CORRECTIONS + 1):
        g, jacobian = nlp.derivatives["jac_g"](x, data)
        values = np.asarray(g).ravel()
        unmet = (bounds.g_lower - values)[equal]
        if not np.abs(unmet).max(initial=0.0) < best:
            break
        best = np.abs(unmet).max(initial=0.0)
        outcome = replace(outcome, x=x, g=values, objective=float(nlp.derivatives["grad_f"](x, data)[0]))
        free = np.flatnonzero(np.minimum(x - bounds.x_lower, bounds.x_upper - x) > AT_BOUND)
        pattern = jacobian.sparsity()
        entries = (np.array(jacobian.nonzeros()), pattern.row(), pattern.colind())
        rows = sp.csc_matrix(entries, shape=jacobian.shape)[equal][:, free]
        system = sp.block_array([[sp.identity(free.size), rows.T], [rows, -NEGLIGIBLE * sp.identity(equal.size)]])
        moved = splu(system.tocsc()).solve(np.concatenate([np.zeros(free.size), unmet]))[: free.size]
        x = x.copy()
        x[free] += moved
    return outcome
