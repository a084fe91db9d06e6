"""Sparse matrices of numbers, and systems of equations with them, for small ones without the import of SciPy."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.layout import Index

Solve = Callable[[Array], Array]

MANY_ENTRIES = 50_000
"""Number of entries above which SciPy's SuperLU takes less time than CasADi, its import included."""


@dataclass(frozen=True, eq=False)
class SparseMatrix:
    """A sparse matrix as a list of entries.

    Attributes
    ----------
    rows, columns : (n,) int arrays
        Place of each entry; no two are equal.
    values : (n,) array
    shape : (int, int)

    Examples
    --------
    >>> matrix = SparseMatrix.read(ca.DM([[1, 0], [0, 2]]))
    >>> matrix.times(np.array([3.0, 4.0]))
    array([3., 8.])
    """

    rows: Index
    columns: Index
    values: Array
    shape: tuple[int, int]

    @classmethod
    def read(cls, matrix: ca.DM) -> "SparseMatrix":
        """Return the entries of a CasADi matrix."""
        pattern = matrix.sparsity()
        rows, columns = (np.array(part, dtype=np.intp) for part in (pattern.row(), pattern.get_col()))
        return cls(rows, columns, np.array(matrix.nonzeros(), dtype=float), matrix.shape)

    @classmethod
    def read_symmetric(cls, upper: ca.DM) -> "SparseMatrix":
        """Return the entries of a symmetric matrix from its upper triangle.

        Examples
        --------
        >>> SparseMatrix.read_symmetric(ca.DM([[1, 3], [0, 2]])).times(np.array([1.0, 1.0]))
        array([4., 5.])
        """
        half = cls.read(upper)
        above = half.rows < half.columns
        return cls(
            np.concatenate([half.rows, half.columns[above]]),
            np.concatenate([half.columns, half.rows[above]]),
            np.concatenate([half.values, half.values[above]]),
            half.shape,
        )

    def write(self) -> ca.DM:
        """Return the CasADi matrix."""
        order = np.lexsort((self.rows, self.columns))  # column-major, as CasADi stores
        first = np.searchsorted(self.columns[order], np.arange(self.shape[1] + 1))
        pattern = ca.Sparsity(*self.shape, first.tolist(), self.rows[order].tolist())
        return ca.DM(pattern, self.values[order].tolist())  # CasADi converts lists faster than arrays

    def scale(self, rows: Array | float, columns: Array | float) -> "SparseMatrix":
        """Return the matrix with each row and each column multiplied by a number."""
        n_rows, n_columns = self.shape
        factors = np.broadcast_to(rows, n_rows)[self.rows] * np.broadcast_to(columns, n_columns)[self.columns]
        return replace(self, values=self.values * factors)

    def select(self, rows: NDArray[np.bool_], columns: NDArray[np.bool_] | None = None) -> "SparseMatrix":
        """Return the matrix of some rows and columns; by default of all columns."""
        columns = np.ones(self.shape[1], dtype=bool) if columns is None else columns
        kept = rows[self.rows] & columns[self.columns]
        place, place_column = np.cumsum(rows) - 1, np.cumsum(columns) - 1
        shape = int(rows.sum()), int(columns.sum())
        return SparseMatrix(place[self.rows[kept]], place_column[self.columns[kept]], self.values[kept], shape)

    def below_identity(self) -> "SparseMatrix":
        """Return the matrix below the identity."""
        n_rows, n = self.shape
        unit = np.arange(n)
        return SparseMatrix(
            np.concatenate([unit, n + self.rows]),
            np.concatenate([unit, self.columns]),
            np.concatenate([np.ones(n), self.values]),
            (n + n_rows, n),
        )

    def times(self, other: Array) -> Array:
        """Return the product with a vector, or with the columns of a dense matrix."""
        if other.ndim == 2:
            products = [self.times(column) for column in other.T]
            return np.column_stack(products) if products else np.empty((self.shape[0], 0))
        return np.bincount(self.rows, self.values * other[self.columns], self.shape[0]).astype(float)

    def counts(self) -> Index:
        """Return the number of entries of each row."""
        return np.bincount(self.rows, minlength=self.shape[0])

    def norms(self) -> Array:
        """Return the Euclidean norm of each row."""
        return np.sqrt(np.bincount(self.rows, self.values**2, self.shape[0]))


def factorise(rows: SparseMatrix, regularisation: float, corrections: int = 0) -> Solve:
    """Return the solver of ``[[I, R^T], [R, -regularisation I]] x = b`` for a matrix R and right sides b, (n + m, k).

    The matrix is quasi-definite: it has a factorisation L D L^T without pivoting, for dependent rows, too.  The errors
    are those of rounding divided by the regularisation; each correction by the residual squares them.

    Parameters
    ----------
    rows : SparseMatrix
    regularisation : float
    corrections : int
    """
    m, n = rows.shape
    unit, below = np.arange(n + m), n + rows.rows
    system = SparseMatrix(
        np.concatenate([unit, below, rows.columns]),
        np.concatenate([unit, rows.columns, below]),
        np.concatenate([np.ones(n), np.full(m, -regularisation), rows.values, rows.values]),
        (n + m, n + m),
    )
    large = rows.values.size > MANY_ENTRIES
    solve = _factorise_by_superlu(system) if large else _factorise_by_casadi(system, regularisation)

    def solve_and_correct(right: Array) -> Array:
        solution = solve(right)
        for _ in range(corrections):
            solution += solve(right - system.times(solution))
        return solution

    return solve_and_correct


def _factorise_by_casadi(system: SparseMatrix, regularisation: float) -> Solve:
    matrix = system.write()
    with defer_interrupt():
        # ca.Linsol prints a warning to the terminal if a pivot vanishes by cancellation, which ca.ldl does not.
        pivots, upper, order = ca.ldl(matrix)
    # Without rounding errors no pivot is smaller than the regularisation.
    diagonal = np.array(pivots).ravel()
    factors = ca.DM(np.where(diagonal == 0.0, -regularisation, diagonal).tolist()), upper, order

    def solve(right: Array) -> Array:
        with defer_interrupt():
            return np.array(ca.ldl_solve(ca.DM(right), *factors))

    return solve


def _factorise_by_superlu(system: SparseMatrix) -> Solve:
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu

    matrix = coo_matrix((system.values, (system.rows, system.columns)), shape=system.shape).tocsc()
    # Pivots on the diagonal leave a factor with an eighth of the entries.
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def solve(right: Array) -> Array:
        return np.asarray(factors.solve(right))

    return solve
