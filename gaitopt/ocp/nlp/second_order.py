"""Sufficient conditions of a strict local minimum, checked at a solution of an NLP.

Let S be the rows of equalities and of active inequalities with a multiplier that is not zero.  A solution is a strict
local minimum if the Hessian of the Lagrangian is positive definite on the null space of S (Nocedal & Wright, Numerical
Optimization, theorem 12.6); this needs no linear independence.  If the null space is {0} the minimum is sharp: the
cost increases at first order in every admissible direction, as at the vertex of a linear program.

An interior-point method stops at a distance from such a vertex, where many multipliers and slacks are equally small.  A
linear program in a small box around the solution then determines which constraints are active (crossover).
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import scipy  # which imports its parts when they are used

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Nlp

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import SuperLU

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

PROBES = 16
"""Number of random vectors that are projected onto the null space at a time."""


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
    check = _Conditions(nlp, x, multipliers, data, bounds, np.ones(x.size) if sizes is None else sizes)
    result = check.conclude()
    if result.verdict in (Verdict.SHARP, Verdict.STRICT) or nlp.smooth:
        return result
    vertex = check.cross_over()
    return vertex.conclude() if vertex is not None else result


class _Conditions:
    """The solution in terms of one vector of values (unknowns, then rows) with one vector of multipliers."""

    def __init__(
        self, nlp: Nlp, x: Array, multipliers: tuple[Array, Array], data: Array, bounds: Bounds, sizes: Array
    ) -> None:
        self.nlp, self.x, self.data, self.bounds = nlp, x, data, bounds
        self.sizes, scaling = sizes, scipy.sparse.diags(sizes)
        with defer_interrupt():
            g, jacobian = nlp.derivatives["jac_g"](x, data)
        self.jacobian = _sparse(jacobian)
        self.gradients = scipy.sparse.vstack([scipy.sparse.identity(x.size), self.jacobian], format="csr")
        self.scaled_gradients = (self.gradients @ scaling).tocsr()
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
        scaling = scipy.sparse.diags(self.sizes)
        hessian = scaling @ _sparse(upper) @ scaling
        hessian = (hessian + scipy.sparse.triu(hessian, 1).T).tocsr()
        least = CURVED * max(1.0, float(np.abs(hessian).max()))
        basis = _null_space(self.scaled_gradients[self.equal | self.strong])
        weakly = _restrict(basis, self.scaled_gradients[self.active & ~self.strong])
        curvature = _least_curvature(hessian, basis)
        if not basis.shape[1]:
            verdict = Verdict.SHARP
        elif curvature > least:
            verdict = Verdict.STRICT
        else:
            saddle = bool(weakly.shape[1]) and _least_curvature(hessian, weakly) < -least
            verdict = Verdict.SADDLE if saddle else Verdict.UNDECIDED
        return SecondOrder(
            verdict=verdict,
            active=np.flatnonzero(self.active),
            weak=np.flatnonzero(self.active & ~self.strong),
            dependent=int((self.equal | self.active).sum()) - (self.x.size - weakly.shape[1]),
            free_directions=basis.shape[1],
            curvature=curvature,
            slacks=self.slacks,
        )

    def cross_over(self) -> "_Conditions | None":
        """Return the check at the vertex of the linear program around the solution; None if no vertex is nearby."""
        with defer_interrupt():
            slope = np.asarray(self.nlp.derivatives["grad_f"](self.x, self.data)[1]).ravel() / self.nlp.typical
        n, size = self.x.size, BOX * np.maximum(1.0, np.abs(self.x))
        lower = np.maximum(self.lower[:n] - self.x, -size)
        upper = np.minimum(self.upper[:n] - self.x, size)
        rows, equal = self.values[n:], self.equal[n:]
        above, below = ~equal & np.isfinite(self.upper[n:]), ~equal & np.isfinite(self.lower[n:])
        answer = scipy.optimize.linprog(
            slope,
            A_ub=scipy.sparse.vstack([self.jacobian[above], -self.jacobian[below]]),
            b_ub=np.concatenate([(self.upper[n:] - rows)[above], (rows - self.lower[n:])[below]]),
            A_eq=self.jacobian[equal],
            b_eq=(self.lower[n:] - rows)[equal],
            bounds=np.column_stack([np.minimum(lower, upper), upper]),
            method="highs-ds",
        )
        if answer.status != 0 or -answer.fun > NEGLIGIBLE_GAIN or np.any(np.abs(answer.x) > 0.9 * size):
            return None
        on_rows = np.zeros(rows.size)
        on_rows[equal] = -answer.eqlin.marginals
        count = int(above.sum())
        on_rows[above] -= answer.ineqlin.marginals[:count]
        on_rows[below] += answer.ineqlin.marginals[count:]
        on_bounds = -(answer.lower.marginals + answer.upper.marginals)
        scaled = (on_bounds * self.nlp.typical, on_rows * self.nlp.typical)
        vertex = _Conditions(self.nlp, self.x, scaled, self.data, self.bounds, self.sizes)
        vertex._determine_active(self.values + self.gradients @ answer.x)
        return vertex

    def _determine_active(self, values: Array) -> None:
        """Determine the active constraints at a vertex from its values and the multipliers of its linear program."""
        gaps = np.minimum(values - self.lower, self.upper - values)
        self.slacks = np.where(self.equal, np.inf, gaps)
        self.active = ~self.equal & (self.slacks < SMALL)
        self.strong = self.active & (np.abs(self.multipliers) > ROUNDING)

    def _on_rows(self) -> Array:
        return self.multipliers[self.x.size :]


def _sparse(matrix: ca.DM) -> "csr_matrix":
    """Return a CasADi matrix as a SciPy matrix."""
    pattern = matrix.sparsity()
    values = np.asarray(matrix.nz[:]).ravel()
    return scipy.sparse.csc_matrix((values, pattern.row(), pattern.colind()), shape=matrix.shape).tocsr()


def _null_space(gradients: "csr_matrix") -> Array:
    """Return an orthonormal basis of the null space of a sparse matrix, shape (n, dimension).

    Random vectors are projected onto the null space until a projection depends linearly on the previous ones.
    """
    n = gradients.shape[1]
    fixed = np.zeros(n, dtype=bool)
    single = np.diff(gradients.indptr) == 1
    fixed[gradients[single].indices] = True
    rows = gradients[~single][:, ~fixed]
    sizes = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
    rows = scipy.sparse.diags(1 / sizes[sizes > 0]) @ rows[sizes > 0]
    free = n - int(fixed.sum())
    basis = np.empty((free, 0))
    if free:
        project, random = _projection(rows), np.random.default_rng(0)
        while basis.shape[1] < free:
            probes = project(random.standard_normal((free, min(PROBES, free))))
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


def _restrict(basis: Array, rows: "csr_matrix") -> Array:
    """Return an orthonormal basis of the vectors of a subspace that lie in the null space of some rows."""
    if not (rows.shape[0] and basis.shape[1]):
        return basis
    sizes = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
    _, values, vectors = np.linalg.svd((rows @ basis) / np.where(sizes > 0, sizes, 1.0)[:, None])
    rank = int(np.sum(values > np.sqrt(REGULARISATION)))
    return np.asarray(basis @ vectors[rank:].T)


def _projection(rows: "csr_matrix") -> Callable[[Array], Array]:
    """Return the function that projects columns orthogonally onto the null space of some rows."""
    n, m = rows.shape[1], rows.shape[0]
    if not m:
        return lambda vectors: vectors
    matrix = scipy.sparse.bmat(
        [[scipy.sparse.identity(n), rows.T], [rows, -REGULARISATION * scipy.sparse.identity(m)]], format="csc"
    )
    # The matrix is quasi-definite: pivots on its diagonal leave a factor with an eighth of the entries.
    splu = scipy.sparse.linalg.splu
    factors: SuperLU = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def project(vectors: Array) -> Array:
        for _ in range(2):  # the second projection removes the rounding errors of the first
            vectors = factors.solve(np.vstack([vectors, np.zeros((m, vectors.shape[1]))]))[:n]
        return vectors

    return project


def _least_curvature(hessian: "csr_matrix", basis: Array) -> float:
    """Return the least eigenvalue of a matrix reduced to a subspace; nan if the subspace is {0}."""
    if not basis.shape[1]:
        return float("nan")
    return float(np.linalg.eigvalsh(basis.T @ (hessian @ basis))[0])
