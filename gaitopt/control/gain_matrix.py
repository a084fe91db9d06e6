"""Position of a matrix of feedback gains in the table of a law."""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array


@dataclass(frozen=True)
class GainMatrix:
    """A matrix of feedback gains, stored column by column in the rows of a law's table.

    Attributes
    ----------
    name : str
    rows, columns : tuple of str
        Names of the torques, and of the entries of the state whose deviations they depend on.
    first : int
        Row of the table with the first entry of the matrix.
    slope : int or None
        Row of the table with the first entry of its derivative with respect to the clock [1/s]; None if the matrix
        is constant within each piece.

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

    def shift_rows(self, rows: int) -> "GainMatrix":
        """Return the same matrix shifted by a number of rows of the table."""
        slope = None if self.slope is None else self.slope + rows
        return GainMatrix(self.name, self.rows, self.columns, self.first + rows, slope)

    def values(self, table: Array, first: int) -> Array:
        """Return the matrix in each piece of a table, from its first row on, shape (K, n_rows, n_columns)."""
        shape = len(self.columns), len(self.rows)
        entries = np.asarray(table)[first : first + shape[0] * shape[1]]
        return np.array([column.reshape(shape).T for column in entries.T])
