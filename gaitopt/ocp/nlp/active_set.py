"""Newton's method on the optimality conditions, with a primal-dual active set, for smooth optima.

One step solves

    [ H + rho J_a' J_a   J' ] [ dx ]     [ -grad f - rho J_a' c ]
    [ J                  -D ] [ m+ ]  =  [ -c - D m             ]

with the Hessian H of the Lagrangian, the Jacobian J of all constraints, and the violations c and rows J_a of the active
ones: equalities, violated constraints, and constraints at their bound with a multiplier of the active sign.  This
primal-dual active set makes the method a semismooth Newton method (Hintermueller, Ito & Kunisch, SIAM J. Optim. 13,
2002).  D is 1e-11 for active constraints, a proximal term that admits dependent ones, and 1e12 for the others, which
removes them; variables at an active bound are fixed by a penalty of 1e12.  The pattern of the matrix is therefore
constant, and with rho > 0 the matrix has a factorisation L D L' without pivoting in any order, whose signs distinguish
a minimum from a saddle.
"""

import functools
import math
import time
from dataclasses import replace

import casadi as ca
import numpy as np
from attrs import evolve, field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.interrupts import stop_on_interrupt
from gaitopt.locks import ONE_AT_A_TIME
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.factorisation_warnings import discard_warnings
from gaitopt.ocp.nlp.ipopt import LARGE, Ipopt
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, Barrier, NlpResult, UpdateData
from gaitopt.parameters import instance_of
from gaitopt.progress import Iteration, Observer, silent
from gaitopt.status import Status

MOST_STEPS = 15
"""Largest number of Newton steps; convergence is quadratic, so more steps seldom help."""

SOFT, STIFF = 1e-11, 1e12
"""Compliance of active constraints; penalty of fixed variables, and compliance of inactive constraints."""

_MESSAGES = {
    Status.SOLVED: CONVERGED,
    Status.INTERRUPTED: "User_Requested_Stop",
    Status.TIME_LIMIT: "Maximum_WallTime_Exceeded",
}

EQUAL_COST = 1e-4
"""Largest relative increase in cost at which Newton's result counts as the minimum of the fallback."""

RESTING = 1e-7
"""Distance from a bound within which the bound may be active; Ipopt leaves 1e-8."""

MOST_ENTRIES = 200
"""Largest number of unknowns of a constraint; longer rows, such as an integral over a fine grid, fill the matrix."""


@check_arguments
@frozen(kw_only=True)
class Newton:
    """Newton's method for smooth objectives, such as squared torques, with Ipopt as its fallback.

    Objectives with kinks are passed to the fallback: their optima switch torques on and off, many constraints are
    weakly active, and the active set is not unique.  With absolute work, as in the cost of transport, a gait that is
    warm-started from one on the same grid is first solved by sequential quadratic programming.  Smooth objectives per
    weight and travel on fine grids are passed on as well, because the row that sums the integral makes steps slow.

    Attributes
    ----------
    fallback : Ipopt
        Solver used when Newton's method does not converge; its tolerance and its limits apply to both.

    Raises
    ------
    InputError
        If `fallback` is not an Ipopt.

    Examples
    --------
    >>> Newton(fallback=Ipopt(max_iterations=100)).fallback.max_iterations
    100
    """

    fallback: Ipopt = field(factory=Ipopt, validator=instance_of(Ipopt, example="an Ipopt(...)"))

    def start_clock(self) -> "Newton":
        """Return the solver whose time limit, counted from now, is that of all NLPs it solves together."""
        fallback = self.fallback.start_clock()
        return self if fallback is self.fallback else evolve(self, fallback=fallback)

    def minimise(
        self,
        nlp: Nlp,
        x: Array,
        data: Array,
        bounds: Bounds,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
        barrier: Barrier = 1e-6,
        update_data: UpdateData | None = None,
    ) -> NlpResult:
        """Solve an NLP from a starting point, see :class:`gaitopt.ocp.nlp.nlp_solver.NlpSolver`."""
        if not nlp.smooth and multipliers is not None and update_data is not None:
            from gaitopt.ocp.nlp.sqp import minimise_from_solution  # which a solve without a warm start does not need

            with ONE_AT_A_TIME:
                near = minimise_from_solution(nlp, x, data, bounds, observer, multipliers, self.fallback, update_data)
            if near is not None:
                return near
        if not nlp.smooth or _longest_row(nlp) > MOST_ENTRIES:
            return self.fallback.minimise(nlp, x, data, bounds, observer, multipliers, barrier)

        def run_newton(x: Array, multipliers: Array, observer: Observer) -> NlpResult | None:
            run = _Run(nlp, data, bounds, self.fallback)
            with ONE_AT_A_TIME, stop_on_interrupt(run.interrupt):
                result = run.minimise(x, multipliers, observer)
            if result is None and run.interrupted:
                raise KeyboardInterrupt  # the interrupt arrived in the last step
            return result

        # From the solution on another grid, which has another active set, steps on a large NLP would be wasted.
        result, large = None, nlp.n_variables > LARGE
        if update_data is not None or not large:
            initial_multipliers = np.zeros(nlp.n_constraints) if multipliers is None else multipliers[1]
            result = run_newton(x, initial_multipliers, observer)
        if result is None:
            result = self.fallback.minimise(nlp, x, data, bounds, observer, multipliers, barrier)
            if result.status.ok and not large:  # full accuracy: an interior point lies slightly outside its bounds
                exact = run_newton(result.x, result.multipliers[1], silent)
                if exact is not None and exact.status is Status.INTERRUPTED:
                    result = replace(result, status=exact.status, message=exact.message)
                elif (
                    exact is not None
                    and exact.status.ok
                    and exact.objective <= result.objective + EQUAL_COST * abs(result.objective)
                ):
                    result = replace(exact, iterations=result.iterations + exact.iterations)
        return result


@functools.lru_cache(maxsize=32)
def _longest_row(nlp: Nlp) -> int:
    """Return the largest number of unknowns of a constraint."""
    return int(np.bincount(nlp.derivatives.constraints[1].sparsity().row()).max(initial=0))


class _Run:
    """One run of Newton's method."""

    def __init__(self, nlp: Nlp, data: Array, bounds: Bounds, options: Ipopt) -> None:
        self.nlp, self.data, self.tolerance, self.interrupted = nlp, data, options.tolerance, False
        self.deadline = options.deadline()
        self.most_steps = min(MOST_STEPS, int(options.max_iterations))
        self.limits = (bounds.x_lower, bounds.x_upper, bounds.g_lower, bounds.g_upper)

    def interrupt(self) -> None:
        """Request a stop after the present step."""
        self.interrupted = True

    def minimise(self, x: Array, multipliers: Array, observer: Observer) -> NlpResult | None:
        """Return the minimum reached from a start, or the iterate of a stop; None if the method does not converge."""
        iterate, inertia = _build_iterate(self.nlp)
        scaled, before = multipliers / self.nlp.typical, (math.inf, math.inf)
        for number in range(self.most_steps + 1):
            with discard_warnings():
                results = iterate(x, scaled, self.data, *self.limits)
            f, unmet, wrong = (float(number[0]) for number in results[:3])
            g, on_bounds, on_rows, active, step, matrix = results[3:]
            finite = math.isfinite(f + unmet + wrong) and bool(np.isfinite(np.concatenate((g, on_rows, x, step))).all())
            mean = np.abs(on_rows).sum() / max(1, g.size) if finite else math.inf
            converged = finite and max(wrong / max(1.0, mean), unmet) <= self.tolerance
            saddle = converged and inertia(matrix) != self.nlp.n_constraints
            g = g.copy()  # the arrays returned by Functions are overwritten by the next call
            unscaled = (on_bounds * self.nlp.typical, on_rows * self.nlp.typical)
            self._report(observer, Iteration(number, f, unmet))
            if status := self._ending(converged and not saddle):
                return NlpResult(status, _MESSAGES[status], x, g, f, number, unscaled)
            # The first step sets the multipliers, so it may increase the error; from then on the error must fall, or
            # if it is within the tolerance, the violation.
            decreases = wrong < before[0] or (wrong <= self.tolerance and unmet < before[1])
            if saddle or not finite or (number > 1 and not decreases):
                return None
            x, scaled, before = x + step[: x.size], active * step[x.size :], (wrong, unmet)
        return None

    def _ending(self, converged: bool) -> Status | None:
        """Return the status with which the method ends at an iterate, or None if it continues."""
        if self.interrupted:
            return Status.INTERRUPTED
        if converged:
            return Status.SOLVED
        return Status.TIME_LIMIT if time.perf_counter() > self.deadline else None

    def _report(self, observer: Observer, iteration: Iteration) -> None:
        try:
            observer(iteration)
        except KeyboardInterrupt:
            self.interrupt()


class _Inertia:
    """Count of negative eigenvalues: at a minimum one per constraint (Sylvester's law of inertia)."""

    def __init__(self, factors: ca.Linsol) -> None:
        self._factors = factors

    def __call__(self, nonzeros: Array) -> int:
        matrix = ca.DM(self._factors.sparsity(), nonzeros.tolist())  # CasADi converts lists faster than arrays
        with discard_warnings():
            self._factors.nfact(matrix)
        return int(self._factors.neig(matrix))


@functools.lru_cache(maxsize=32)
def _build_iterate(nlp: Nlp) -> tuple[FastCall, _Inertia]:
    """Return the Function of one iterate, and the count of the negative eigenvalues of its matrix.

    The Function maps (x, scaled multipliers, data, bounds) to the objective, the violation, the error of the gradient
    of the Lagrangian, the constraints, the multipliers of bounds and constraints, whether constraints are active, the
    step of x above the next multipliers, and the matrix.
    """
    n, m = nlp.n_variables, nlp.n_constraints
    derivatives, multipliers = nlp.derivatives, ca.MX.sym("lam", m)
    x, data = derivatives.inputs[:2]
    x_lower, x_upper = ca.MX.sym("x_lower", n), ca.MX.sym("x_upper", n)
    lower, upper = ca.MX.sym("lower", m), ca.MX.sym("upper", m)
    (f, gradient), (g, jacobian) = derivatives.minimised, derivatives.constraints

    # The values of all rows, and of all unknowns, are side by side.
    rows = _row_conditions()
    values = rows.map(m).call([g, multipliers, lower, upper]) if m else [ca.MX(1, 0)] * rows.n_out()
    active, lam, unmet, compliance, row_right, row_outside = values
    hessian = ca.triu2symm(derivatives.hessian(1 / nlp.typical, lam.T))
    unknowns = [x, gradient, lam @ jacobian, unmet @ jacobian, x_lower, x_upper, nlp.typical]
    columns = _bound_conditions().map(n).call(unknowns)
    on_bounds, stiffness, right, slope, outside = columns

    transposed = jacobian.T
    augmented = hessian + transposed @ (ca.diag(active) @ jacobian) + ca.diag(stiffness)
    # The matrix is symmetric: its rows are its columns, which CasADi stacks faster.
    matrix = ca.horzcat(ca.horzcat(augmented, transposed).T, ca.horzcat(jacobian, ca.diag(compliance)).T)
    factors = ca.Linsol("factors", "ldl", matrix.sparsity())
    step = factors.solve(matrix, ca.veccat(right, row_right))
    violation, error = ca.norm_inf(ca.horzcat(outside, row_outside)), ca.norm_inf(slope)
    inputs = [x, multipliers, data, x_lower, x_upper, lower, upper]
    outputs = [f, violation, error, g, on_bounds, lam, active, step, matrix]
    return FastCall(ca.Function("iterate", inputs, outputs)), _Inertia(factors)


@functools.cache
def _row_conditions() -> ca.Function:
    """Return the Function of one row (value, scaled multiplier, bounds), which is evaluated for every row of an NLP.

    Its values are whether the row is active, its multiplier, its violation if it is, its entry -D of the matrix, its
    entry of the right-hand side, and the size of its violation, active or not.
    """
    g, multiplier, lower, upper = (ca.SX.sym(name) for name in ("g", "multiplier", "lower", "upper"))
    above, below = ca.logic_or(multiplier + g > upper, lower == upper), multiplier + g < lower
    active = ca.logic_or(above, below)
    lam = active * multiplier
    unmet = ca.if_else(above, g - upper, ca.if_else(below, g - lower, 0))
    compliance = -ca.if_else(active, SOFT, STIFF)
    outside = ca.fmax(ca.fabs(unmet), _excess(g, lower, upper))
    outputs = [active, lam, unmet, compliance, -unmet - SOFT * lam, outside]
    return ca.Function("rows", [g, multiplier, lower, upper], outputs)


@functools.cache
def _bound_conditions() -> ca.Function:
    """Return the Function of one unknown, which is evaluated for every unknown of an NLP.

    Its inputs are the unknown, the derivative of the objective, the products of multipliers and violations of the rows
    with its column of the Jacobian, its bounds, and the size of the objective.  Its values are the multiplier of its
    bounds, its penalty if it is fixed at one of them, its entry of the right-hand side, the derivative of the
    Lagrangian if it is not fixed, and the size of its violation or of its distance from the bound where it is fixed.
    """
    names = ("x", "gradient", "product", "violations", "lower", "upper", "size")
    x, gradient, product, violations, lower, upper, size = inputs = [ca.SX.sym(name) for name in names]
    slope = gradient / size + product
    at_upper, at_lower = x > upper - RESTING, x < lower + RESTING
    low = ca.logic_or(ca.logic_and(at_lower, slope > 0), x < lower - RESTING)
    high = ca.logic_or(ca.logic_and(at_upper, slope < 0), x > upper + RESTING)
    equal = lower == upper
    fixed = ca.logic_or(ca.logic_or(low, high), equal)
    to_bound = ca.if_else(ca.logic_or(low, equal), lower - x, ca.if_else(high, upper - x, 0))
    right = STIFF * fixed * to_bound + fixed * slope - gradient / size - violations
    outside = ca.fmax(ca.fabs(to_bound), _excess(x, lower, upper))
    outputs = [-fixed * slope, STIFF * fixed, right, (1 - fixed) * slope, outside]
    return ca.Function("bounds", inputs, outputs)


def _excess(values: ca.SX, lower: ca.SX, upper: ca.SX) -> ca.SX:
    return ca.fmax(ca.fmax(lower - values, values - upper), 0)
