"""Sequential quadratic programming (SQP) from a nearby solution, for objectives with kinks.

One step d solves the quadratic program (QP)

    minimise    grad f' d + 1/2 d' (H + r I) d
    subject to  lower - g <= J d <= upper - g,  lower - x <= d <= upper - x,  |d| <= box

with the Hessian H of the Lagrangian and the Jacobian J of the constraints (Nocedal & Wright, Numerical Optimization,
2nd ed., chapter 18).  The interior-point method PIQP, part of CasADi, solves a QP in the time of two iterations of
Ipopt, because the derivatives are evaluated once per QP.  The kinks are linear inequalities and equalities, so that
four to six QPs suffice near a solution.  If the steps do not converge, there is no result.
"""

import functools
import math
import threading
import time

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt, stop_on_interrupt
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, NlpResult, UpdateData
from gaitopt.progress import Iteration, Observer
from gaitopt.reductions import worst
from gaitopt.status import Status

MOST_STEPS = 12
"""Largest number of QPs."""

MOST_ITERATIONS = 100
"""Largest number of iterations of a QP; most take 15 to 40."""

FIRST_PROXIMAL, PROXIMAL = 1e-4, 1e-7
"""Weights r of the squared step in the scaled objective: of the first step, whose multipliers belong to another
problem, and of the others, small because optima are flat in some directions.  Once the gradient of the Lagrangian is
within the tolerance, the first weight keeps steps from drifting along such directions, which violates the constraints.
"""

FIRST_BOX, BOX, DECREASE, MOST_REJECTED = 1.0, 3.0, 0.25, 3
"""Largest change of an unknown in the first and in a later step, relative to its size, at least 1; its factor after a
rejected step, half of which the next accepted step revokes; and the number of rejected steps after which the method
ends.  Smaller boxes delay convergence; larger ones may lead along directions of negative curvature to other optima."""

MOST_WORSE = 0.2
"""Largest relative increase of the merit function; a decrease is not required, because this would slow convergence."""

USED_INPUTS = 7
"""Number of inputs of a QP that are used: Hessian, gradient, rows, their bounds, and those of the unknowns."""

LARGE_STEP = 1e-3
"""Change of an unknown relative to its size, at least 1, up to which data that depend on the unknowns are kept."""

ACCURATE = 10.0
"""Factor of the tolerance for the gradient of the Lagrangian and for the complementarity."""


def minimise_from_solution(
    nlp: Nlp,
    x: Array,
    data: Array,
    bounds: Bounds,
    observer: Observer,
    multipliers: tuple[Array, Array],
    options: Ipopt,
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
        Called before each step and at the end.
    multipliers : (n_variables,), (n_constraints,) arrays
        Multipliers of the solution.
    options : Ipopt
        Its tolerance, of the constraints and relative to the scale of the gradient, and its limits of iterations and
        time apply.
    update_data : callable, optional
        See :class:`gaitopt.ocp.nlp.nlp_solver.NlpSolver`.
    """
    if not ca.has_conic("piqp"):
        return None
    fixed = tuple(np.flatnonzero(bounds.x_lower == bounds.x_upper).tolist())
    with defer_interrupt():
        steps, interrupt = _Steps(_compile(nlp, fixed), bounds, fixed, update_data), threading.Event()
        iterate = steps.evaluate(_PrimalDual(x, multipliers[0] / nlp.typical, multipliers[1] / nlp.typical), data)
    deadline = options.deadline()
    weight, box, rejected, last = FIRST_PROXIMAL, FIRST_BOX, 0, min(MOST_STEPS, int(options.max_iterations))
    with stop_on_interrupt(interrupt.set):
        for number in range(last + 1):
            _report(observer, Iteration(number, iterate.f, iterate.violation), interrupt)
            if interrupt.is_set():
                return _conclude(Status.INTERRUPTED, "User_Requested_Stop", iterate, number, nlp.typical)
            if max(iterate.violation, iterate.error / ACCURATE) <= options.tolerance:
                return _conclude(Status.SOLVED, CONVERGED, iterate, number, nlp.typical)
            if number == last or rejected > MOST_REJECTED or time.perf_counter() > deadline:
                break
            following = steps.take(iterate, weight, box)
            if following is not None:
                iterate, box = following, min(BOX, box / math.sqrt(DECREASE))
                weight = PROXIMAL if iterate.error > options.tolerance else FIRST_PROXIMAL
            else:
                box, rejected = DECREASE * box, rejected + 1
    if interrupt.is_set():
        raise KeyboardInterrupt  # the interrupt arrived in the last step
    return None


def _report(observer: Observer, iteration: Iteration, interrupt: threading.Event) -> None:
    try:
        observer(iteration)
    except KeyboardInterrupt:
        interrupt.set()


def _conclude(status: Status, message: str, iterate: "_Iterate", number: int, typical: float) -> NlpResult:
    """Return the result at an iterate, with the multipliers of the objective that is not scaled."""
    trial = iterate.trial
    unscaled = trial.on_bounds * typical, trial.on_rows * typical
    return NlpResult(status, message, trial.x, iterate.g, iterate.f, number, unscaled, iterate.data)


@dataclass(frozen=True, eq=False)
class _PrimalDual:
    """Unknowns, and multipliers of bounds and rows for the scaled objective."""

    x: Array
    on_bounds: Array
    on_rows: Array


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Values and derivatives at a trial point.

    `violation` is the largest of a bound or row; `error` that of the gradient of the Lagrangian or complementarity.
    """

    trial: _PrimalDual
    data: Array
    f: float
    g: Array
    scaled: float
    gradient: Array
    hessian: Array
    rows: Array
    violation: float
    error: float


@dataclass(frozen=True, eq=False)
class _Compiled:
    """Function of values and derivatives, QP solver, and places of the diagonal in the Hessian."""

    evaluate: FastCall
    solve: FastCall
    diagonal: Index


@dataclass(frozen=True, eq=False)
class _Steps:
    """Steps of one solve.  Fixed unknowns are rows of the QPs, because their bounds have no interior."""

    compiled: _Compiled
    bounds: Bounds
    fixed: tuple[int, ...]
    update_data: UpdateData | None

    def evaluate(self, trial: _PrimalDual, data: Array) -> _Iterate:
        """Return the values and derivatives at a trial point."""
        numbers, g, *arrays = self.compiled.evaluate(trial.x, data, trial.on_rows)
        g, gradient, hessian, rows, slope = (array.copy() for array in (g, *arrays))
        f, scaled = numbers.tolist()
        values, lower, upper = self._values(trial.x, g)
        multipliers = np.concatenate([trial.on_bounds, trial.on_rows])
        with np.errstate(invalid="ignore"):  # zero times infinity
            distances = np.minimum(np.abs(np.where(multipliers > 0, upper, lower) - values), 1.0)
        loose = np.where(multipliers == 0, 0.0, distances * np.abs(multipliers))
        scale = max(1.0, float(np.abs(multipliers).sum()) / max(1, g.size))
        violation = worst(0.0, lower - values, values - upper)
        error = worst(np.abs(slope + trial.on_bounds), loose) / scale
        return _Iterate(trial, data, f, g, scaled, gradient, hessian, rows, violation, error)

    def take(self, iterate: _Iterate, weight: float, box: float) -> _Iterate | None:
        """Return the iterate after a step; None if the QP has no solution or the step increases the merit function."""
        trial = self._solve_qp(iterate, weight, box)
        if trial is None:
            return None
        size = worst(np.abs(trial.x - iterate.trial.x) / np.maximum(1.0, np.abs(iterate.trial.x)))
        data = iterate.data
        if self.update_data is not None and size > LARGE_STEP:
            data = self.update_data(trial.x)
        following = self.evaluate(trial, data)
        before, after = (self._merit(point, trial) for point in (iterate, following))
        return following if after <= before + MOST_WORSE * abs(before) and following.error < math.inf else None

    def _solve_qp(self, iterate: _Iterate, weight: float, box: float) -> _PrimalDual | None:
        x, g, fixed, bounds = iterate.trial.x, iterate.g, list(self.fixed), self.bounds
        lower, upper = bounds.x_lower - x, bounds.x_upper - x
        to_fixed, size = lower[fixed], box * np.maximum(1.0, np.abs(x))
        boxed = lower < -size, upper > size
        lower, upper = np.maximum(np.minimum(upper, -size), lower), np.minimum(np.maximum(lower, size), upper)
        lower[fixed], upper[fixed] = -math.inf, math.inf
        hessian = iterate.hessian.copy()
        hessian[self.compiled.diagonal] += weight
        rows = np.concatenate([bounds.g_lower - g, to_fixed]), np.concatenate([bounds.g_upper - g, to_fixed])
        change, _, on_rows, on_bounds = self.compiled.solve(
            hessian, iterate.gradient, iterate.rows, *rows, lower, upper
        )
        if not self.compiled.solve.succeeded or not np.all(np.isfinite(change)):
            return None
        on_bounds = on_bounds.copy()
        on_bounds[(boxed[0] & (on_bounds < 0)) | (boxed[1] & (on_bounds > 0))] = 0.0  # multipliers of the box
        on_bounds[fixed] = on_rows[g.size :]
        return _PrimalDual(np.clip(x + change, bounds.x_lower, bounds.x_upper), on_bounds, on_rows[: g.size].copy())

    def _merit(self, iterate: _Iterate, trial: _PrimalDual) -> float:
        """Return the scaled objective plus the violations, weighted by the multipliers of a trial point."""
        values, lower, upper = self._values(iterate.trial.x, iterate.g)
        violations = np.maximum(0.0, np.maximum(lower - values, values - upper))
        return iterate.scaled + float(np.abs(np.concatenate([trial.on_bounds, trial.on_rows])) @ violations)

    def _values(self, x: Array, g: Array) -> tuple[Array, Array, Array]:
        """Return unknowns and rows in one vector, and their lower and upper bounds."""
        bounds = self.bounds
        lower, upper = (bounds.x_lower, bounds.g_lower), (bounds.x_upper, bounds.g_upper)
        return np.concatenate([x, g]), np.concatenate(lower), np.concatenate(upper)


@functools.lru_cache(maxsize=32)
def _compile(nlp: Nlp, fixed: tuple[int, ...]) -> _Compiled:
    """Return the Functions of an NLP with some fixed unknowns; built once."""
    n, x, data, lam = nlp.n_variables, nlp.functions["x"], nlp.functions["p"], ca.MX.sym("lam", nlp.n_constraints)
    f, gradient = nlp.derivatives["grad_f"](x, data)
    g, jacobian = nlp.derivatives["jac_g"](x, data)
    hessian = ca.triu2symm(nlp.derivatives["hess_lag"](x, data, 1 / nlp.typical, lam))
    hessian = ca.project(hessian, hessian.sparsity() + ca.Sparsity.diag(n))
    rows = ca.vertcat(jacobian, ca.MX(ca.DM.eye(n)[list(fixed), :]))
    scaled = gradient / nlp.typical
    outputs = [ca.vertcat(f, f / nlp.typical), g, scaled, hessian, rows, scaled + jacobian.T @ lam]
    solver = ca.conic(
        "solver",
        "piqp",
        {"h": hessian.sparsity(), "a": rows.sparsity()},
        {"error_on_fail": False, "piqp": {"max_iter": MOST_ITERATIONS}},
    )
    unused = (np.zeros(solver.nnz_in(i)) for i in range(USED_INPUTS, solver.n_in()))
    diagonal = hessian.sparsity().get_nz([i * (n + 1) for i in range(n)])
    evaluate = ca.Function("evaluate", [x, data, lam], outputs)
    return _Compiled(FastCall(evaluate), FastCall(solver, *unused), np.array(diagonal, dtype=np.intp))
