"""Entries of vectors and sparse matrices; entries with equal indices are summed."""

from collections.abc import Sequence

import casadi as ca
import numpy as np


class Entries:
    """Entries of a vector or sparse matrix, block by block."""

    def __init__(self) -> None:
        self.rows: list[list[int]] = []
        self.columns: list[list[int]] = []
        self.values: list[ca.MX] = []

    def add(self, rows: list[int], columns: list[int], values: ca.MX) -> None:
        """Append entries."""
        self.rows.append(rows)
        self.columns.append(columns)
        self.values.append(ca.vec(values))

    def matrix(self, shape: tuple[int, int], *, upper: bool) -> ca.MX:
        """Return the sparse matrix that sums the entries, or its upper triangle."""
        rows, columns = (
            np.concatenate([np.asarray(part, dtype=np.int64) for part in parts]) for parts in (self.rows, self.columns)
        )
        entries = ca.vertcat(*self.values)
        if upper:
            keep = np.flatnonzero(rows <= columns)
            rows, columns, entries = rows[keep], columns[keep], entries[keep.tolist()]
        key, position = np.unique(columns * shape[0] + rows, return_inverse=True)  # column-major, as CasADi stores
        pattern = ca.Sparsity.triplet(*shape, (key % shape[0]).tolist(), (key // shape[0]).tolist())
        return ca.MX(pattern, scatter(position.tolist(), len(key), entries))


def scatter(index: Sequence[int], size: int, values: ca.MX) -> ca.MX:
    """Return the vector of `size` whose entry i sums the values with index i."""
    selection = ca.Sparsity.triplet(size, len(index), list(index), list(range(len(index))))
    return ca.DM(selection, 1.0) @ values
