"""Newton's method on the conditions of optimality: the quickest road to a smooth optimum, where it leads there.

One step solves

    [ H + rho J_a' J_a   J' ] [ dx ]     [ -grad f - rho J_a' c ]
    [ J                  -D ] [ m+ ]  =  [ -c - D m             ]

with the Hessian H of the Lagrangian, the Jacobian J of all constraints, and the violations c and rows J_a of the active
ones: equalities, what is violated, and what rests on its bound and is pressed against it by its multiplier (a primal-
dual active set, which makes this a semismooth Newton method: Hintermueller, Ito & Kunisch, SIAM J. Optim. 13, 2002).
D is tiny for active constraints, a proximal term that lets them depend on each other, and huge for the others, which
takes them out; variables held at a bound are held by a stiff spring.  So the matrix keeps its pattern, and thanks to
rho it has a factorisation L D L' without pivoting whatever the order, whose signs tell a minimum from a saddle.
"""

import functools
import math
from dataclasses import replace

import casadi as ca
import numpy as np
from attrs import field, frozen

from gaitopt.interrupts import stop_on_interrupt
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.ipopt import ONE_AT_A_TIME, Ipopt
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, NlpResult
from gaitopt.parameters import instance_of
from gaitopt.progress import Iteration, Observer, silent
from gaitopt.status import Status

MOST_STEPS = 15
"""Newton's method has arrived by then, or will not."""

SOFT, STIFF = 1e-11, 1e12
"""Compliance of active constraints; stiffness of what is held, whose inverse is the compliance of what is let go."""

_MESSAGES = {Status.SOLVED: CONVERGED, Status.INTERRUPTED: "User_Requested_Stop"}

EQUAL_COST = 1e-4
"""Newton's method may leave another solver's minimum dearer by this share and still has stayed with it."""

RESTING = 1e-7
"""Distance from a bound at which a variable rests on it; Ipopt leaves 1e-8."""

MOST_ENTRIES = 200
"""A constraint of more unknowns, such as an integral over a fine grid, fills the matrix."""


@frozen(kw_only=True)
class Newton:
    """Newton's method for smooth objectives, such as squared torques; another solver where it does not arrive.

    Objectives with kinks, such as the cost of transport, go to the other solver at once: their optima switch torques
    on and off, many constraints are active by a hair, and Newton's method has no single active set to settle on.  So do
    smooth ones per weight and travel on fine grids, where the row that sums the integral makes steps slow.

    Attributes
    ----------
    otherwise : Ipopt
        Its tolerance is Newton's, too, and so is its limit of iterations.

    Raises
    ------
    InputError
        If `otherwise` is no Ipopt.

    Examples
    --------
    >>> Newton(fallback=Ipopt(max_iterations=100)).fallback.max_iterations
    100
    """

    fallback: Ipopt = field(factory=Ipopt, validator=instance_of(Ipopt, example="an Ipopt(...)"))

    def minimise(
        self,
        nlp: Nlp,
        x: Array,
        data: Array,
        bounds: Bounds,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
        barrier: float = 1e-6,
    ) -> NlpResult:
        """Solve an NLP from a starting point, see :class:`gaitopt.ocp.nlp.nlp_solver.NlpSolver`."""
        if not nlp.smooth or _longest_row(nlp) > MOST_ENTRIES:
            return self.fallback.minimise(nlp, x, data, bounds, observer, multipliers, barrier)

        def arrived(x: Array, multipliers: Array, observer: Observer) -> NlpResult | None:
            run = _Run(nlp, data, bounds, self.fallback)
            with ONE_AT_A_TIME, stop_on_interrupt(run.interrupt):
                found = run.arrived(x, multipliers, observer)
            if found is None and run.interrupted:
                raise KeyboardInterrupt  # it came as Newton's method gave up
            return found

        begun = np.zeros(nlp.n_constraints) if multipliers is None else multipliers[1]
        found = arrived(x, begun, observer)
        if found is None:
            found = self.fallback.minimise(nlp, x, data, bounds, observer, multipliers, barrier)
            if found.status.ok:  # to the last digits: an interior point stays a little outside of its bounds
                exact = arrived(found.x, found.multipliers[1], silent)
                if exact is not None and exact.status is Status.INTERRUPTED:
                    found = replace(found, status=exact.status, message=exact.message)
                elif exact is not None and exact.objective <= found.objective + EQUAL_COST * abs(found.objective):
                    found = replace(exact, iterations=found.iterations + exact.iterations)
        return found


@functools.lru_cache(maxsize=32)
def _longest_row(nlp: Nlp) -> int:
    """Return the number of unknowns of the constraint with the most of them."""
    return int(np.bincount(nlp.derivatives["jac_g"].sparsity_out(1).row()).max(initial=0))


class _Run:
    """One run of Newton's method."""

    def __init__(self, nlp: Nlp, data: Array, bounds: Bounds, options: Ipopt) -> None:
        self.nlp, self.data, self.tolerance, self.interrupted = nlp, data, options.tolerance, False
        self.most_steps = min(MOST_STEPS, int(options.max_iterations))
        self.limits = (bounds.x_lower, bounds.x_upper, bounds.g_lower, bounds.g_upper)

    def interrupt(self) -> None:
        """Ask to stop after the present step."""
        self.interrupted = True

    def arrived(self, x: Array, multipliers: Array, observer: Observer) -> NlpResult | None:
        """Return the minimum arrived at from a start, or where it was interrupted; None if it goes astray."""
        iterate, inertia = _iterate(self.nlp)
        scaled, before = multipliers / self.nlp.typical, (math.inf, math.inf)
        for number in range(self.most_steps + 1):
            numbers, g, on_bounds, on_rows, x_after, scaled_after, matrix = iterate(x, scaled, self.data, *self.limits)
            f, unmet, wrong, mean = numbers.tolist()
            # CasADi's norms leave out what is not a number, which the next iterate shows.
            sound = math.isfinite(sum(float(part.sum()) for part in (numbers, g, x_after, scaled_after)))
            there = sound and max(wrong / max(1.0, mean), unmet) <= self.tolerance
            saddle = there and inertia(matrix) != self.nlp.n_constraints
            # What Functions return lies in memory of their own.
            g, x_after, scaled_after = g.copy(), x_after.copy(), scaled_after.copy()
            prices = (on_bounds * self.nlp.typical, on_rows * self.nlp.typical)
            self._tell(observer, Iteration(number, f, unmet))
            if self.interrupted or (there and not saddle):
                status = Status.INTERRUPTED if self.interrupted else Status.SOLVED
                return NlpResult(status, _MESSAGES[status], x, g, f, number, prices)
            # The first step brings multipliers along, of whatever size; from then on the error must fall, and where
            # there is none left, what is violated.
            nearer = wrong < before[0] or (wrong <= self.tolerance and unmet < before[1])
            if saddle or not sound or (number > 1 and not nearer):
                return None
            x, scaled, before = x_after, scaled_after, (wrong, unmet)
        return None

    def _tell(self, observer: Observer, iteration: Iteration) -> None:
        try:
            observer(iteration)
        except KeyboardInterrupt:
            self.interrupt()


class _Inertia:
    """Counts negative eigenvalues; there is one for each constraint at a minimum (Sylvester's law of inertia)."""

    def __init__(self, pattern: ca.Sparsity) -> None:
        self._pattern, self._factors = pattern, ca.Linsol("inertia", "ldl", pattern)

    def __call__(self, nonzeros: Array) -> int:
        matrix = ca.DM(self._pattern, nonzeros)
        self._factors.nfact(matrix)
        return int(self._factors.neig(matrix))


@functools.lru_cache(maxsize=32)
def _iterate(nlp: Nlp) -> tuple[FastCall, _Inertia]:
    """Return the Function of one iterate, and what tells whether its matrix is that of a minimum.

    Of (x, scaled multipliers, data, bounds) it returns four numbers (the objective, the violation, the error of the
    gradient of the Lagrangian and the mean size of the multipliers), the constraints, the multipliers of bounds
    and constraints, the next x and multipliers, and the matrix.
    """
    x, data, given = nlp.functions["x"], nlp.functions["p"], ca.MX.sym("lam", nlp.n_constraints)
    x_lower, x_upper = ca.MX.sym("x_lower", nlp.n_variables), ca.MX.sym("x_upper", nlp.n_variables)
    lower, upper = ca.MX.sym("lower", nlp.n_constraints), ca.MX.sym("upper", nlp.n_constraints)
    f, gradient = nlp.derivatives["grad_f"](x, data)
    g, jacobian = nlp.derivatives["jac_g"](x, data)

    above, below = ca.logic_or(given + g > upper, lower == upper), given + g < lower
    active = ca.logic_or(above, below)
    lam = active * given
    unmet = ca.if_else(above, g - upper, ca.if_else(below, g - lower, 0))
    hessian = ca.triu2symm(nlp.derivatives["hess_lag"](x, data, 1 / nlp.typical, lam))
    turned = jacobian.T
    slope = gradient / nlp.typical + turned @ lam

    at_upper, at_lower = x > x_upper - RESTING, x < x_lower + RESTING
    low = ca.logic_or(ca.logic_and(at_lower, slope > 0), x < x_lower - RESTING)
    high = ca.logic_or(ca.logic_and(at_upper, slope < 0), x > x_upper + RESTING)
    fixed = x_lower == x_upper
    held = ca.logic_or(ca.logic_or(low, high), fixed)
    pulled = ca.if_else(ca.logic_or(low, fixed), x_lower - x, ca.if_else(high, x_upper - x, 0))

    spring, compliance = STIFF * held, ca.if_else(active, SOFT, STIFF)
    matrix = ca.blockcat(
        [[hessian + turned @ (ca.diag(active) @ jacobian) + ca.diag(spring), turned], [jacobian, -ca.diag(compliance)]]
    )
    pull = spring * pulled + held * slope - gradient / nlp.typical - turned @ unmet
    step = ca.solve(matrix, ca.vertcat(pull, -unmet - SOFT * lam), "ldl")
    # What is outside counts whether it is thought to be active or not.
    outside = ca.vertcat(_excess(x, x_lower, x_upper), _excess(g, lower, upper))
    violation = ca.norm_inf(ca.vertcat(unmet, pulled, outside))
    error = ca.norm_inf((1 - held) * slope)
    numbers = ca.vertcat(f, violation, error, ca.norm_1(lam) / max(1, nlp.n_constraints))
    moved, priced = ca.vertsplit(step, [0, nlp.n_variables, nlp.n_variables + nlp.n_constraints])
    following = [x + moved, active * priced]
    inputs = [x, given, data, x_lower, x_upper, lower, upper]
    function = ca.Function("iterate", inputs, [numbers, g, -held * slope, lam, *following, matrix])
    return FastCall(function), _Inertia(matrix.sparsity())


def _excess(values: ca.MX, lower: ca.MX, upper: ca.MX) -> ca.MX:
    return ca.fmax(ca.fmax(lower - values, values - upper), 0)
