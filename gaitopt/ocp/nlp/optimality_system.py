"""First-order optimality conditions of an NLP and their derivatives with respect to unknowns and data, compiled.

With multipliers m of the rows and the objective divided by its typical size, the gradient of the Lagrangian is

    slope(x, m, z) = grad f(x, z) / typical + J(x, z)' m.

The derivatives with respect to the data z are exact, so that solutions can be continued in any number of the NLP.
"""

import functools
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import scipy  # which imports its parts when they are used
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.locks import cached_property
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.factorisation_warnings import discard_warnings
from gaitopt.ocp.nlp.nlp import Nlp

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

SOFT, STIFF = 1e-11, 1e12
"""Compliance of active rows; penalty of fixed unknowns, and compliance of inactive rows."""


@dataclass(frozen=True, eq=False)
class OptimalityValues:
    """Objective, gradient of the scaled Lagrangian of the rows, (n_variables,), and rows, (n_constraints,)."""

    f: float
    slope: Array
    g: Array


@dataclass(frozen=True, eq=False)
class DataSlopes:
    """Derivatives along a direction of the data: of `slope` and of the rows."""

    slope: Array
    g: Array


class OptimalitySystem:
    """The optimality conditions of one NLP.

    Parameters
    ----------
    nlp : Nlp
    """

    def __init__(self, nlp: Nlp) -> None:
        self.nlp = nlp
        with defer_interrupt():
            self._functions = _compile(nlp)
        self._patterns = [_pattern(self._functions.matrices, place) for place in (0, 1)]

    def evaluate(self, x: Array, multipliers: Array, data: Array) -> OptimalityValues:
        """Return the values; the multipliers are those of the scaled objective."""
        f, slope, g = self._functions.values_call(x, multipliers, data)
        return OptimalityValues(float(f[0]), slope.copy(), g.copy())

    def differentiate(self, x: Array, multipliers: Array, data: Array) -> tuple["csc_matrix", "csc_matrix"]:
        """Return the Jacobian of the rows and the Hessian of the scaled Lagrangian, sparse matrices."""
        jacobian, hessian = (
            scipy.sparse.csc_matrix((array.copy(), rows, columns), shape=shape)
            for array, (rows, columns, shape) in zip(
                self._functions.matrices_call(x, multipliers, data), self._patterns, strict=True
            )
        )
        return jacobian, hessian

    def differentiate_by_data(self, x: Array, multipliers: Array, data: Array, direction: Array) -> DataSlopes:
        """Return the derivatives along a direction of the data, shape (n_z,)."""
        slope, g = self._functions.slopes_call(x, multipliers, data, direction)
        return DataSlopes(slope.copy(), g.copy())

    def differentiate_lagrangian(self, x: Array, multipliers: Array, data: Array, direction: Array) -> float:
        """Return the derivative of the Lagrangian of the rows, which is not scaled, along a direction of the data."""
        return float(self._functions.lagrangian_call(x, multipliers, data)[0] @ direction)

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
        return OptimalityFactors(self.nlp, self._functions, entries.copy())


class OptimalityFactors:
    """Factorisations of the matrix of the optimality conditions of an active set, [[H + J_a' J_a, J_a'], [J_a, 0]].

    Parameters
    ----------
    nlp : Nlp
    functions : _SystemFunctions
    entries : (k,) array
        Nonzeros of the matrix, by column.
    """

    def __init__(self, nlp: Nlp, functions: "_SystemFunctions", entries: Array) -> None:
        self._nlp, self._functions, self._entries = nlp, functions, entries

    @cached_property
    def negative(self) -> int:
        """Number of negative eigenvalues of the Hessian reduced to the null space of the active constraints.

        The inertia of the matrix determines it (Nocedal & Wright, Numerical Optimization, theorem 16.3).
        """
        solver = self._functions.solver
        with defer_interrupt(), discard_warnings():
            matrix = ca.DM(self._functions.pattern, self._entries.tolist())  # CasADi converts lists faster than arrays
            solver.nfact(matrix)
            return int(solver.neig(matrix)) - self._nlp.n_constraints

    def solve(self, right: Array) -> Array:
        """Return the solution of [[H, J_a'], [J_a, 0]] for a right side, shape (n_variables + n_constraints,).

        The matrix is factorised in every call: this takes as long as the solution with its factors.
        """
        with defer_interrupt(), discard_warnings():
            return self._functions.solve_call(self._entries, right)[0].copy()


@dataclass(frozen=True, eq=False)
class _SystemFunctions:
    matrices: ca.Function
    values_call: FastCall
    matrices_call: FastCall
    slopes_call: FastCall
    lagrangian_call: FastCall
    matrix_call: FastCall
    solve_call: FastCall
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
    # Differentiating the compiled derivatives would evaluate second derivatives that are not used.
    plain = [nlp.functions[name] for name in ("f", "g")]
    cost, rows = ca.substitute(plain, [nlp.functions["x"], nlp.functions["p"]], [x, data])
    lagrangian = cost + nlp.typical * ca.dot(lam, rows)
    varied = ca.gradient(lagrangian, x) / nlp.typical, rows
    values = ca.Function("optimality", [x, lam, data], [f, ca.densify(slope), ca.densify(g)])
    matrices = ca.Function("optimality_derivatives", [x, lam, data], [jacobian, hessian])
    inputs = [x, lam, data, direction]
    slopes = ca.Function("data_slopes", inputs, [ca.densify(ca.jtimes(part, data, direction)) for part in varied])
    by_data = ca.Function("lagrangian_slope", [x, lam, data], [ca.densify(ca.gradient(lagrangian, data))])
    active, fixed = ca.MX.sym("active", nlp.n_constraints), ca.MX.sym("fixed", nlp.n_variables)
    # The rows of the active constraints convexify the matrix, which then has a factorisation without pivoting.
    augmented = hessian + jacobian.T @ (ca.diag(active) @ jacobian) + ca.diag(STIFF * fixed)
    matrix = ca.blockcat([[augmented, jacobian.T], [jacobian, -ca.diag(ca.if_else(active, SOFT, STIFF))]])
    entries, right = ca.MX.sym("entries", matrix.sparsity()), ca.MX.sym("right", matrix.size1())
    n = nlp.n_variables
    convexified = right + ca.vertcat(entries[n:, :n].T @ right[n:], 0 * lam)
    solution = ca.Function("optimality_solution", [entries, right], [ca.solve(entries, convexified, "ldl")])
    return _SystemFunctions(
        matrices=matrices,
        values_call=FastCall(values),
        matrices_call=FastCall(matrices),
        slopes_call=FastCall(slopes),
        lagrangian_call=FastCall(by_data),
        matrix_call=FastCall(ca.Function("optimality_matrix", [x, lam, data, active, fixed], [matrix])),
        solve_call=FastCall(solution),
        pattern=matrix.sparsity(),
        solver=ca.Linsol("optimality_factors", "ldl", matrix.sparsity()),
    )


def _pattern(function: ca.Function, place: int) -> tuple[NDArray[np.int32], NDArray[np.int32], tuple[int, int]]:
    """Return row indices, column pointers and shape of a sparse output."""
    pattern = function.sparsity_out(place)
    rows, columns = np.array(pattern.row(), dtype=np.int32), np.array(pattern.colind(), dtype=np.int32)
    return rows, columns, (pattern.size1(), pattern.size2())
