"""First-order optimality conditions of an NLP as compiled Functions, with their derivatives by unknowns and data.

With multipliers m of the rows and the objective divided by its typical size, the gradient of the Lagrangian is

    slope(x, m, z) = grad f(x, z) / typical + J(x, z)' m.

The derivatives by the data z are exact, so that solutions can be continued in any number of the NLP.
"""

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import scipy  # which imports its parts when they are used
from numpy.typing import NDArray

from gaitopt.interrupts import defer_interrupt
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.nlp import Nlp

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

SOFT, STIFF = 1e-11, 1e12
"""Compliance of active rows; penalty of fixed unknowns, and compliance of inactive rows."""


@dataclass(frozen=True, eq=False)
class OptimalityValues:
    """Values and derivatives at unknowns and multipliers.

    Attributes
    ----------
    f : float
        Objective.
    slope : (n_variables,) array
        Gradient of the scaled Lagrangian of the rows.
    g : (n_constraints,) array
    jacobian : (n_constraints, n_variables) sparse matrix
    hessian : (n_variables, n_variables) sparse matrix
        Hessian of the scaled Lagrangian.
    """

    f: float
    slope: Array
    g: Array
    jacobian: "csc_matrix"
    hessian: "csc_matrix"


@dataclass(frozen=True, eq=False)
class DataSlopes:
    """Derivatives along a direction of the data: of the objective, of `slope` and of the rows."""

    f: float
    slope: Array
    g: Array


class OptimalitySystem:
    """The optimality conditions of one NLP.

    Parameters
    ----------
    nlp : Nlp

    Attributes
    ----------
    last_factors : OptimalityFactors or None
        Those that the linear solver stores.
    """

    last_factors: "OptimalityFactors | None"

    def __init__(self, nlp: Nlp) -> None:
        self.nlp, self.last_factors = nlp, None
        with defer_interrupt():
            self._functions = _compile(nlp)
        self._patterns = [_pattern(self._functions.values, place) for place in (3, 4)]

    def evaluate(self, x: Array, multipliers: Array, data: Array) -> OptimalityValues:
        """Return values and derivatives; the multipliers are those of the scaled objective."""
        f, slope, g, *entries = self._functions.values_call(x, multipliers, data)
        jacobian, hessian = (
            scipy.sparse.csc_matrix((array.copy(), rows, columns), shape=shape)
            for array, (rows, columns, shape) in zip(entries, self._patterns, strict=True)
        )
        return OptimalityValues(float(f[0]), slope.copy(), g.copy(), jacobian, hessian)

    def differentiate_by_data(self, x: Array, multipliers: Array, data: Array, direction: Array) -> DataSlopes:
        """Return the derivatives along a direction of the data, shape (n_z,)."""
        f, slope, g = self._functions.slopes_call(x, multipliers, data, direction)
        return DataSlopes(float(f[0]), slope.copy(), g.copy())

    def factorise(
        self, x: Array, multipliers: Array, data: Array, active: NDArray[np.bool_], fixed: NDArray[np.bool_]
    ) -> "OptimalityFactors":
        """Return the factors of the optimality matrix of an active set.

        Parameters
        ----------
        x, multipliers, data : arrays
        active : (n_constraints,) bool array
            Active rows.
        fixed : (n_variables,) bool array
            Unknowns at an active bound.
        """
        (entries,) = self._functions.matrix_call(x, multipliers, data, active, fixed)
        with defer_interrupt():
            matrix = ca.DM(self._functions.pattern, entries.tolist())  # CasADi converts lists faster than arrays
        return OptimalityFactors(self, matrix, self._functions.solver)


class OptimalityFactors:
    """Factors of the matrix of the optimality conditions of an active set, [[H + J_a' J_a, J_a'], [J_a, 0]].

    The linear solver stores the factors of one matrix, the last one; those of another are computed again when needed.

    Parameters
    ----------
    system : OptimalitySystem
    matrix : DM
    solver : Linsol
    """

    def __init__(self, system: OptimalitySystem, matrix: ca.DM, solver: ca.Linsol) -> None:
        self._system, self._matrix, self._solver = system, matrix, solver

    def _factorise(self) -> None:
        if self._system.last_factors is not self:
            self._system.last_factors = self
            self._solver.nfact(self._matrix)

    @functools.cached_property
    def negative(self) -> int:
        """Number of negative eigenvalues of the Hessian reduced to the null space of the active constraints.

        The inertia of the matrix determines it (Nocedal & Wright, Numerical Optimization, theorem 16.3).
        """
        with defer_interrupt():
            self._factorise()
            return int(self._solver.neig(self._matrix)) - self._system.nlp.n_constraints

    def solve(self, right: Array) -> Array:
        """Return the solution for a right side, shape (n_variables + n_constraints,)."""
        with defer_interrupt():
            self._factorise()
            return np.asarray(self._solver.solve(self._matrix, ca.DM(right.tolist()))).ravel()


@dataclass(frozen=True, eq=False)
class _SystemFunctions:
    values: ca.Function
    values_call: FastCall
    slopes_call: FastCall
    matrix_call: FastCall
    pattern: ca.Sparsity
    solver: ca.Linsol


@functools.lru_cache(maxsize=32)
def _compile(nlp: Nlp) -> _SystemFunctions:
    """Return the Functions of an NLP; built once."""
    x, lam = ca.MX.sym("x", nlp.n_variables), ca.MX.sym("lam", nlp.n_constraints)
    data = ca.MX.sym("p", nlp.derivatives["grad_f"].size1_in(1))
    direction = ca.MX.sym("dp", data.numel())
    f, gradient = nlp.derivatives["grad_f"](x, data)
    g, jacobian = nlp.derivatives["jac_g"](x, data)
    hessian = ca.triu2symm(nlp.derivatives["hess_lag"](x, data, 1 / nlp.typical, lam))
    slope = gradient / nlp.typical + jacobian.T @ lam
    values = ca.Function("optimality", [x, lam, data], [f, ca.densify(slope), ca.densify(g), jacobian, hessian])
    changes = [ca.densify(ca.jtimes(part, data, direction)) for part in (f, slope, g)]
    slopes = ca.Function("data_slopes", [x, lam, data, direction], changes)
    active, fixed = ca.MX.sym("active", nlp.n_constraints), ca.MX.sym("fixed", nlp.n_variables)
    # The rows of the active constraints convexify the matrix, which then has a factorisation without pivoting.
    augmented = hessian + jacobian.T @ (ca.diag(active) @ jacobian) + ca.diag(STIFF * fixed)
    matrix = ca.blockcat([[augmented, jacobian.T], [jacobian, -ca.diag(ca.if_else(active, SOFT, STIFF))]])
    solver = ca.Linsol("optimality_factors", "ldl", matrix.sparsity())
    matrix_call = FastCall(ca.Function("optimality_matrix", [x, lam, data, active, fixed], [matrix]))
    return _SystemFunctions(values, FastCall(values), FastCall(slopes), matrix_call, matrix.sparsity(), solver)


def _pattern(function: ca.Function, place: int) -> tuple[NDArray[np.int32], NDArray[np.int32], tuple[int, int]]:
    """Return row indices, column pointers and shape of a sparse output."""
    pattern = function.sparsity_out(place)
    rows, columns = np.array(pattern.row(), dtype=np.int32), np.array(pattern.colind(), dtype=np.int32)
    return rows, columns, (pattern.size1(), pattern.size2())
