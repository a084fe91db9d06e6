"""Entries of vectors and sparse matrices; entries with equal indices are summed."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.ocp.nlp.layout import Index


class Entries:
    """Entries of a vector or sparse matrix, block by block."""

    def __init__(self) -> None:
        self._rows: list[Index] = []
        self._columns: list[Index] = []
        self._values: list[ca.MX] = []

    def add(self, rows: Index, columns: Index, values: ca.MX) -> None:
        """Append entries, in the column-major order of three tables of equal size."""
        self._rows.append(rows.ravel(order="F"))
        self._columns.append(columns.ravel(order="F"))
        self._values.append(values)

    def vector(self, size: int) -> ca.MX:
        """Return the dense vector that sums the entries."""
        return scatter(np.concatenate(self._rows).tolist(), size, ca.veccat(*self._values))

    def matrix(self, shape: tuple[int, int]) -> ca.MX:
        """Return the sparse matrix that sums the entries."""
        rows, columns = np.concatenate(self._rows), np.concatenate(self._columns)
        key, position = np.unique(columns * shape[0] + rows, return_inverse=True)  # column-major, as CasADi stores
        first = np.searchsorted(key, shape[0] * np.arange(shape[1] + 1))
        pattern = ca.Sparsity(*shape, first.tolist(), (key % shape[0]).tolist())
        return ca.MX(pattern, scatter(position.tolist(), len(key), ca.veccat(*self._values)))


def scatter(index: Sequence[int], size: int, values: ca.MX) -> ca.MX:
    """Return the vector of `size` whose entry i sums the values with index i.

    A permutation of the values, such as the entries of a Jacobian, is built and evaluated faster than their sums.
    """
    order = np.full(size, -1)
    order[index] = np.arange(len(index))
    if 0 < size == len(index) and order.min() >= 0:
        return values[order.tolist()]
    selection = ca.Sparsity(size, len(index), list(range(len(index) + 1)), list(index))  # one entry per column
    return ca.MX(ca.DM(selection, 1.0)) @ values
