"""Sequential quadratic programming from a nearby solution, for objectives with kinks.

One step solves the quadratic program (QP)

    minimise    grad f' d + 1/2 d' (H + r I) d
    subject to  lower - g <= J d <= upper - g,  lower - x <= d <= upper - x

with the Hessian H of the Lagrangian and the Jacobian J of the constraints (Nocedal & Wright, Numerical Optimization,
2nd ed., chapter 18).  The interior-point method PIQP, part of CasADi, determines the active constraints of a QP in the
time of two iterations of Ipopt: the derivatives are evaluated once per QP and not in each of its iterations.  Near a
solution four to six steps suffice.  Steps are neither shortened nor tested for descent; if they do not converge, there
is no result.
"""

import functools
import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, NlpResult, UpdateData
from gaitopt.progress import Iteration, Observer
from gaitopt.reductions import worst
from gaitopt.status import Status

MOST_STEPS = 10
"""Largest number of QPs."""

FIRST_PROXIMAL, PROXIMAL = 1e-4, 1e-7
"""Weights r of the squared step in the scaled objective.  The first one is larger because the multipliers, and with
them the Hessian, belong to another problem; optima are flat in some directions, which needs the small second one."""

LARGE_STEP = 1e-3
"""Largest change of an unknown relative to its size, at least 1, after which the data that depend on x are kept."""

ACCURATE = 10.0
"""Factor of the tolerance within which the gradient of the Lagrangian vanishes, in units of the mean multiplier."""

DIVERGED = 10.0
"""Violation of a constraint after a step that ends the method, relative to that at the start, at least 1."""


def minimise_from_solution(
    nlp: Nlp,
    x: Array,
    data: Array,
    bounds: Bounds,
    observer: Observer,
    multipliers: tuple[Array, Array],
    tolerance: float,
    update_data: UpdateData | None = None,
) -> NlpResult | None:
    """Return the minimum of an NLP near a solution of a similar one; None if the steps do not converge.

    Parameters
    ----------
    nlp : Nlp
    x : (n_variables,) array
        The solution.
    data : (n_z,) array
    bounds : Bounds
    observer : Observer
        Called before each step.
    multipliers : (n_variables,), (n_constraints,) arrays
        Multipliers of the solution.
    tolerance : float
        Largest violation of a constraint, and error of the gradient of the Lagrangian relative to its scale.
    update_data : callable, optional
        See :class:`gaitopt.ocp.nlp.nlp_solver.NlpSolver`.
    """
    if not ca.has_conic("piqp"):
        return None
    steps = _build_steps(nlp, tuple(np.flatnonzero(bounds.x_lower == bounds.x_upper).tolist()))
    iterate = _Iterate(x, multipliers[0] / nlp.typical, multipliers[1] / nlp.typical)
    first, size = math.inf, math.inf
    for number in range(MOST_STEPS + 1):
        if update_data is not None and number and size > LARGE_STEP:
            data = update_data(iterate.x)
        point = steps.evaluate(iterate, data, bounds, PROXIMAL if number else FIRST_PROXIMAL)
        observer(Iteration(number, point.f, point.unmet))
        if max(point.unmet, point.error / ACCURATE) <= tolerance:
            scaled = (iterate.on_bounds * nlp.typical, iterate.on_rows * nlp.typical)
            return NlpResult(Status.SOLVED, CONVERGED, iterate.x, point.g, point.f, number, scaled, data)
        first = max(point.unmet, 1.0) if number == 0 else first
        if number == MOST_STEPS or not point.unmet + point.error < math.inf or point.unmet > DIVERGED * first:
            return None
        following = steps.solve_qp(iterate, point, bounds)
        if following is None:
            return None
        size = worst(np.abs(following.x - iterate.x) / np.maximum(1.0, np.abs(iterate.x)))
        iterate = following
    return None


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Unknowns, and multipliers of bounds and rows for the scaled objective."""

    x: Array
    on_bounds: Array
    on_rows: Array


@dataclass(frozen=True, eq=False)
class _Point:
    """Values and derivatives at an iterate."""

    f: float
    g: Array
    gradient: Array
    hessian: Array
    rows: Array
    unmet: float
    error: float


class _Steps:
    """Evaluation of the derivatives, and solution of the QPs, of an NLP with some fixed unknowns.

    Fixed unknowns are rows of the QP, because their bounds have no interior.
    """

    def __init__(self, nlp: Nlp, fixed: tuple[int, ...]) -> None:
        n, m = nlp.n_variables, nlp.n_constraints
        x, data, lam = nlp.functions["x"], nlp.functions["p"], ca.MX.sym("lam", m)
        weight = ca.MX.sym("weight")
        f, gradient = nlp.derivatives["grad_f"](x, data)
        g, jacobian = nlp.derivatives["jac_g"](x, data)
        hessian = ca.triu2symm(nlp.derivatives["hess_lag"](x, data, 1 / nlp.typical, lam)) + weight * ca.MX.eye(n)
        rows = ca.vertcat(jacobian, ca.MX(ca.DM.eye(n)[list(fixed), :])) if fixed else jacobian
        outputs = [f, g, gradient / nlp.typical, hessian, rows, gradient / nlp.typical + jacobian.T @ lam]
        self._patterns = hessian.sparsity(), rows.sparsity()
        self._fixed, self._evaluate = np.array(fixed, dtype=np.intp), FastCall(
            ca.Function("steps", [x, data, lam, weight], outputs)
        )
        shapes = {"h": self._patterns[0], "a": self._patterns[1]}
        self._solve = ca.conic("step", "piqp", shapes, {"error_on_fail": False, "print_problem": False})

    def evaluate(self, iterate: _Iterate, data: Array, bounds: Bounds, weight: float) -> _Point:
        """Return the values and derivatives at an iterate."""
        f, g, gradient, hessian, rows, slope = self._evaluate(iterate.x, data, iterate.on_rows, weight)
        g, x = g.copy(), iterate.x
        unmet = worst(0.0, bounds.x_lower - x, x - bounds.x_upper, bounds.g_lower - g, g - bounds.g_upper)
        mean = (np.abs(iterate.on_bounds).sum() + np.abs(iterate.on_rows).sum()) / max(1, g.size)
        error = worst(np.abs(slope + iterate.on_bounds)) / max(1.0, mean)
        return _Point(float(f[0]), g, gradient.copy(), hessian.copy(), rows.copy(), unmet, error)

    def solve_qp(self, iterate: _Iterate, point: _Point, bounds: Bounds) -> _Iterate | None:
        """Return the next iterate, or None if the QP has no solution."""
        x, g, fixed = iterate.x, point.g, self._fixed
        lower, upper = bounds.x_lower - x, bounds.x_upper - x
        to_fixed = lower[fixed]
        lower[fixed], upper[fixed] = -math.inf, math.inf
        answer = self._solve(
            h=ca.DM(self._patterns[0], point.hessian),
            a=ca.DM(self._patterns[1], point.rows),
            g=point.gradient,
            lbx=lower,
            ubx=upper,
            lba=np.concatenate([bounds.g_lower - g, to_fixed]),
            uba=np.concatenate([bounds.g_upper - g, to_fixed]),
        )
        change, on_bounds, on_rows = (np.asarray(answer[name]).ravel() for name in ("x", "lam_x", "lam_a"))
        if not self._solve.stats()["success"] or not np.all(np.isfinite(change)):
            return None
        on_bounds[fixed] = on_rows[g.size :]
        return _Iterate(x + change, on_bounds, on_rows[: g.size])


@functools.lru_cache(maxsize=32)
def _build_steps(nlp: Nlp, fixed: tuple[int, ...]) -> _Steps:
    return _Steps(nlp, fixed)
