"""Where a matrix of feedback gains lies in the table of a law."""

from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array


@dataclass(frozen=True)
class GainMatrix:
    """A matrix of feedback gains, column by column in the rows of a law's table.

    Attributes
    ----------
    name : str
    rows, columns : tuple of str
        Torques, and the entries of the state whose deviation they multiply.
    first : int
        Row of the table with its first entry.
    slope : int or None
        Row of the table with the first entry of its derivative by the clock [1/s]; None where it is constant within
        each piece.

    Examples
    --------
    >>> matrix = GainMatrix("K", ("hip",), ("th1", "th1_rate"), first=1)
    >>> matrix.values(np.array([[0.0, 0.3], [5.0, 6.0], [1.0, 2.0]]), matrix.first).tolist()
    [[[5.0, 1.0]], [[6.0, 2.0]]]
    """

    name: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    first: int
    slope: int | None = None

    def moved(self, rows: int) -> "GainMatrix":
        """Return the same matrix with so many rows of the table before it."""
        slope = None if self.slope is None else self.slope + rows
        return GainMatrix(self.name, self.rows, self.columns, self.first + rows, slope)

    def values(self, table: Array, first: int) -> Array:
        """Return the matrix in each piece of a table, shape (K, n_rows, n_columns), its first entry in a given row."""
        shape = len(self.columns), len(self.rows)
        entries = np.asarray(table)[first : first + shape[0] * shape[1]]
        return np.array([column.reshape(shape).T for column in entries.T])
