"""Sufficient conditions of a strict local minimum, checked at a solution of an NLP.

Let S be the rows of equalities and of active inequalities with a multiplier that is not zero.  A solution is a strict
local minimum if the Hessian of the Lagrangian is positive definite on the null space of S (Nocedal & Wright, Numerical
Optimization, theorem 12.6); this needs no linear independence.  If the null space is {0} the minimum is sharp: the
cost increases at first order in every admissible direction, as at the vertex of a linear program.

An interior-point method stops at a distance from such a vertex, where many multipliers and slacks are equally small.  A
linear program in a small box around the solution then determines which constraints are active (crossover).  For the
same reason a direction of negative curvature indicates a saddle only if the cost decreases along it: the cost may
increase on one side because of the multiplier of an almost active bound, and the bound may exclude the other side.
"""

import copy
import math
from collections.abc import Callable
from enum import StrEnum

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.sparse_matrix import SparseMatrix, factorise
from gaitopt.parallel.background_call import BackgroundCall

SMALL = 1e-7
"""Scaled multiplier, and distance from a bound, that count as zero."""

CURVED = 1e-8
"""Least curvature that counts as positive, relative to the largest entry of the Hessian; unknowns in typical sizes.

Errors of the multipliers leave 2e-9 at optima of absolute work; the least curvature of smooth optima is above 1e-6.
"""

BOX = 1e-3
"""Half-width of the box of the linear program relative to the size of an unknown, at least 1."""

NEGLIGIBLE_GAIN = 1e-5
"""Decrease of the scaled objective in the linear program that is due to the tolerance of the interior-point method."""

ROUNDING = 1e-12
"""Scaled multiplier of a linear program that counts as zero."""

REGULARISATION = 1e-14
"""Square of the relative size below which a singular value of the constraint gradients is zero."""

HIGHS = {"output_flag": False, "solver": "simplex", "simplex_dual_edge_weight_strategy": 1}
OPTIONS = {"error_on_fail": False, "highs": HIGHS}
"""Options of the linear program: the simplex method ends at a vertex, and takes fewer steps with devex pricing."""

NEAR = 1e-4
"""Distance from a bound below which an interior-point method may have left a constraint that is active."""

REACH, LEAST_DECREASE = 0.1, 1e-9
"""Largest change of an unknown, relative to its typical size, along a direction of negative curvature, and least
decrease of the scaled objective along it that counts as a saddle."""

PROBES, LEAST_PROBES = 16, 4
"""Largest and least number of random vectors that are projected onto the null space at a time."""


class Verdict(StrEnum):
    """Result of the check.

    The cost increases at first order in every admissible direction (sharp), or at second order (strict); it is flat to
    second order in some direction (undecided), or decreases (saddle).
    """

    SHARP = "sharp"
    STRICT = "strict"
    UNDECIDED = "undecided"
    SADDLE = "saddle"


@dataclass(frozen=True, eq=False, kw_only=True)
class SecondOrder:
    """Result of the check of the second-order conditions.

    Attributes
    ----------
    verdict : Verdict
    active : (n,) int array
        Active inequalities: indices of bounds, and of rows counted after the unknowns.
    weak : (n,) int array
        Those of them whose multiplier is zero.
    dependent : int
        Number of active constraints whose gradients depend on those of the others; 0 if LICQ holds.
    free_directions : int
        Dimension of the null space of equalities and strongly active inequalities.
    curvature : float
        Least eigenvalue of the reduced Hessian of the scaled Lagrangian, unknowns in units of their typical sizes; nan
        if there are no free directions.
    slacks : (n_variables + n_constraints,) array
        Distance of each unknown and of each row to its nearer bound; inf without one, and for equalities.
    """

    verdict: Verdict
    active: Index
    weak: Index
    dependent: int
    free_directions: int
    curvature: float
    slacks: Array


def check_second_order(
    nlp: Nlp,
    x: Array,
    multipliers: tuple[Array, Array],
    data: Array,
    bounds: Bounds,
    sizes: Array | None = None,
) -> SecondOrder:
    """Check the second-order conditions at a solution of an NLP.

    Parameters
    ----------
    nlp : Nlp
    x : (n_variables,) array
    multipliers : (n_variables,), (n_constraints,) arrays
        Multipliers of the bounds and of the constraints.
    data : (n_z,) array
    bounds : Bounds
    sizes : (n_variables,) array, optional
        Typical sizes of the unknowns; 1 by default.

    Returns
    -------
    SecondOrder
    """
    return SecondOrderCheck(nlp, x, multipliers, data, bounds, sizes).conclude()


class SecondOrderCheck:
    """A check of the second-order conditions whose linear program, if one is needed, is solved in another thread.

    The parameters are those of :func:`check_second_order`.
    """

    def __init__(
        self,
        nlp: Nlp,
        x: Array,
        multipliers: tuple[Array, Array],
        data: Array,
        bounds: Bounds,
        sizes: Array | None = None,
    ) -> None:
        self._conditions = _Conditions(nlp, x, multipliers, data, bounds, np.ones(x.size) if sizes is None else sizes)
        self._result = self._conditions.conclude()
        decided = self._result.verdict in (Verdict.SHARP, Verdict.STRICT) or nlp.smooth
        self._vertex = None if decided else BackgroundCall(self._conditions.prepare_crossover())

    def conclude(self) -> SecondOrder:
        """Return the result, when the linear program is solved."""
        if self._vertex is None:
            return self._result
        with defer_interrupt():  # the thread cannot be stopped
            vertex = self._vertex.result()
        return self._conditions.move_to(vertex).conclude() if vertex is not None else self._result


@dataclass(frozen=True, eq=False)
class _Vertex:
    """A vertex of the linear program: the step to it, and the multipliers of the scaled objective there."""

    step: Array
    multipliers: Array


class _Conditions:
    """The solution in terms of one vector of values (unknowns, then rows) with one vector of multipliers."""

    def __init__(
        self, nlp: Nlp, x: Array, multipliers: tuple[Array, Array], data: Array, bounds: Bounds, sizes: Array
    ) -> None:
        self.nlp, self.x, self.data = nlp, x, data
        self.sizes = sizes
        with defer_interrupt():
            g, jacobian = nlp.derivatives["jac_g"](x, data)
        self.jacobian = jacobian
        self.gradients = SparseMatrix.read(jacobian).below_identity()
        self.scaled_gradients = self.gradients.scale(1.0, sizes)
        self.multipliers = np.concatenate(multipliers) / nlp.typical
        self.lower = np.concatenate([bounds.x_lower, bounds.g_lower])
        self.upper = np.concatenate([bounds.x_upper, bounds.g_upper])
        self.values = np.concatenate([x, np.asarray(g).ravel()])
        self.equal = self.lower == self.upper
        gaps = np.minimum(self.values - self.lower, self.upper - self.values)
        self.slacks = np.where(self.equal, np.inf, gaps)
        sizes = np.abs(self.multipliers)
        # An interior-point method leaves a small product of slack and multiplier: the larger of the two is not zero.
        self.active = ~self.equal & (self.slacks < np.maximum(SMALL, sizes))
        self.strong = self.active & (sizes > np.maximum(SMALL, self.slacks))

    def conclude(self) -> SecondOrder:
        """Return the result."""
        with defer_interrupt():
            upper = self.nlp.derivatives["hess_lag"](self.x, self.data, 1 / self.nlp.typical, self._on_rows())
        hessian = SparseMatrix.read_symmetric(upper).scale(self.sizes, self.sizes)
        least = CURVED * max(1.0, float(np.max(np.abs(hessian.values), initial=0.0)))
        basis = _null_space(self.scaled_gradients.select(self.equal | self.strong))
        weakly = _restrict(basis, self.scaled_gradients.select(self.active & ~self.strong))
        curvature = _least_curvature(hessian, basis)
        verdict = _judge(curvature, least)
        if verdict is Verdict.UNDECIDED and _least_curvature(hessian, weakly) < -least:
            if self._decreases(hessian, weakly, least):
                verdict = Verdict.SADDLE
            else:  # constraints that an interior-point method leaves close to their bounds are active
                basis = _restrict(basis, self._nearly_active())
                curvature = _least_curvature(hessian, basis)
                verdict = _judge(curvature, least)
        return SecondOrder(
            verdict=verdict,
            active=np.flatnonzero(self.active),
            weak=np.flatnonzero(self.active & ~self.strong),
            dependent=int((self.equal | self.active).sum()) - (self.x.size - weakly.shape[1]),
            free_directions=basis.shape[1],
            curvature=curvature,
            slacks=self.slacks,
        )

    def _decreases(self, hessian: SparseMatrix, basis: Array, least: float) -> bool:
        """Return whether the cost decreases along a direction of negative curvature, up to the next constraint.

        The slope follows from the multipliers of the constraints that may become inactive.  If gradients are almost
        dependent, multipliers are large and a direction satisfies the other constraints with an error; the decrease
        must exceed the effect of this error on the cost.
        """
        curvatures, vectors = np.linalg.eigh(basis.T @ hessian.times(basis))
        fixed = self.equal | self.strong
        for curvature, vector in zip(curvatures, vectors.T, strict=True):
            direction = basis @ vector
            prices = self.multipliers * self.gradients.times(self.sizes * direction)
            error = float(np.sum(np.abs(prices[fixed])))
            for way in (1, -1) if curvature < -least else ():
                reach = min(self._reach(way * direction), REACH / float(np.max(np.abs(direction))))
                slope = -way * float(np.sum(prices[~fixed])) + error
                if reach * (slope + curvature * reach / 2) < -LEAST_DECREASE:
                    return True
        return False

    def _reach(self, direction: Array) -> float:
        """Return the length along a scaled direction to the first inactive constraint of the linearised constraints."""
        change = self.gradients.times(self.sizes * direction)
        room = np.where(change > 0, self.upper - self.values, self.values - self.lower)
        moves = ~self.equal & ~self.active & (np.abs(change) > ROUNDING)
        return float(np.min(room[moves] / np.abs(change[moves]), initial=np.inf))

    def _nearly_active(self) -> SparseMatrix:
        """Return the scaled gradients of the constraints that are active or near their bounds."""
        return self.scaled_gradients.select(~self.equal & ~self.strong & (self.slacks < NEAR))

    def prepare_crossover(self) -> Callable[[], _Vertex | None]:
        """Return the function that solves the linear program around the solution; None if no vertex is nearby.

        The function uses neither Python nor expressions for long, so that it may be called in another thread.
        """
        with defer_interrupt():
            slope = np.asarray(self.nlp.derivatives["grad_f"](self.x, self.data)[1]).ravel() / self.nlp.typical
        n, size = self.x.size, BOX * np.maximum(1.0, np.abs(self.x))
        lower = np.maximum(self.lower[:n] - self.x, -size)
        upper = np.minimum(self.upper[:n] - self.x, size)
        rows, jacobian = self.values[n:], self.jacobian
        with defer_interrupt():
            program = ca.conic("vertex", "highs", {"h": ca.Sparsity(n, n), "a": jacobian.sparsity()}, OPTIONS)
        limits = {"lba": self.lower[n:] - rows, "uba": self.upper[n:] - rows}
        limits |= {"lbx": np.minimum(lower, upper), "ubx": upper}

        def solve_program() -> _Vertex | None:
            with defer_interrupt():
                answer = program(g=slope, a=jacobian, **limits)
                solved = program.stats()["success"]
            step, on_bounds, on_rows = (np.array(answer[name]).ravel() for name in ("x", "lam_x", "lam_a"))
            if not solved or -float(answer["cost"]) > NEGLIGIBLE_GAIN or np.any(np.abs(step) > 0.9 * size):
                return None
            return _Vertex(step, np.concatenate([on_bounds, on_rows]))

        return solve_program

    def move_to(self, vertex: _Vertex) -> "_Conditions":
        """Return the check at a vertex."""
        moved = copy.copy(self)
        moved.multipliers = vertex.multipliers
        moved._determine_active(self.values + self.gradients.times(vertex.step))
        return moved

    def _determine_active(self, values: Array) -> None:
        """Determine the active constraints at a vertex from its values and the multipliers of its linear program."""
        gaps = np.minimum(values - self.lower, self.upper - values)
        self.slacks = np.where(self.equal, np.inf, gaps)
        self.active = ~self.equal & (self.slacks < SMALL)
        self.strong = self.active & (np.abs(self.multipliers) > ROUNDING)

    def _on_rows(self) -> Array:
        return self.multipliers[self.x.size :]


def _null_space(gradients: SparseMatrix) -> Array:
    """Return an orthonormal basis of the null space of a sparse matrix, shape (n, dimension).

    Random vectors are projected onto the null space until a projection depends linearly on the previous ones.
    """
    n = gradients.shape[1]
    fixed, single = np.zeros(n, dtype=bool), gradients.counts() == 1
    fixed[gradients.select(single).columns] = True
    rows = gradients.select(~single, ~fixed)
    sizes = rows.norms()
    rows = rows.select(sizes > 0).scale(1 / sizes[sizes > 0], 1.0)
    free = n - int(fixed.sum())
    basis = np.empty((free, 0))
    if free:
        solve, random = factorise(rows, REGULARISATION), np.random.default_rng(0)
        # At the vertices of optima of absolute work the null space has few dimensions; the first vectors find them.
        count = min(max(free - rows.shape[0], LEAST_PROBES), PROBES)
        while basis.shape[1] < free:
            probes = random.standard_normal((free, min(count, free)))
            count = PROBES
            for _ in range(2):  # the second projection removes the rounding errors of the first
                probes = solve(np.vstack([probes, np.zeros((rows.shape[0], probes.shape[1]))]))[:free]
            sizes = np.linalg.norm(probes, axis=0)
            for _ in range(2):
                probes -= basis @ (basis.T @ probes)
            columns, triangle = np.linalg.qr(probes)
            new = np.abs(np.diag(triangle)) > 1e-6 * np.maximum(sizes, 1.0)
            basis = np.hstack([basis, columns[:, new]])
            if not np.all(new):
                break
    full = np.zeros((n, basis.shape[1]))
    full[~fixed] = basis
    return full


def _restrict(basis: Array, rows: SparseMatrix) -> Array:
    """Return an orthonormal basis of the vectors of a subspace that lie in the null space of some rows."""
    if not (rows.shape[0] and basis.shape[1]):
        return basis
    sizes = rows.norms()
    _, values, vectors = np.linalg.svd(rows.times(basis) / np.where(sizes > 0, sizes, 1.0)[:, None])
    rank = int(np.sum(values > np.sqrt(REGULARISATION)))
    return np.asarray(basis @ vectors[rank:].T)


def _judge(curvature: float, least: float) -> Verdict:
    """Return the verdict from the least curvature in the free directions, which is nan if there are none."""
    if math.isnan(curvature):
        return Verdict.SHARP
    return Verdict.STRICT if curvature > least else Verdict.UNDECIDED


def _least_curvature(hessian: SparseMatrix, basis: Array) -> float:
    """Return the least eigenvalue of a matrix reduced to a subspace; nan if the subspace is {0}."""
    if not basis.shape[1]:
        return float("nan")
    return float(np.linalg.eigvalsh(basis.T @ hessian.times(basis))[0])
