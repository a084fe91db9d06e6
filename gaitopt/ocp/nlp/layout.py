"""Named places in a long vector: what each variable and each constraint is called and where it sits."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.intp]


@dataclass
class Layout:
    """A vector divided into named tables; rows of a table are quantities, columns are places along the gait.

    Examples
    --------
    >>> layout = Layout()
    >>> layout.add("angles", ["th1", "th2"], ["node 0", "node 1"])
    array([[0, 2],
           [1, 3]])
    >>> layout.label(3)
    ('node 1', 'th2')
    """

    size: int = 0
    tables: dict[str, Index] = field(default_factory=dict)
    rows: dict[str, tuple[str, ...]] = field(default_factory=dict)
    labels: list[tuple[str, str]] = field(default_factory=list)

    def add(self, name: str, rows: Sequence[str], places: Sequence[str]) -> Index:
        """Append a table and return its indices, shape (len(rows), len(places))."""
        count = len(rows) * len(places)
        table = np.arange(self.size, self.size + count).reshape(len(places), len(rows)).T
        self.tables[name], self.rows[name] = table, tuple(rows)
        self.labels += [(place, row) for place in places for row in rows]
        self.size += count
        return table

    def __getitem__(self, name: str) -> Index:
        return self.tables[name]

    def __contains__(self, name: str) -> bool:
        return name in self.tables

    def label(self, index: int) -> tuple[str, str]:
        """Return (place, quantity) of an entry."""
        return self.labels[index]


class Rows:
    """Constraint rows under construction: a layout and the bounds of its rows."""

    def __init__(self) -> None:
        self.layout = Layout()
        self._bounds: list[tuple[float, float]] = []

    def add(self, table: str, rows: Sequence[tuple[str, float, float]], places: Sequence[str]) -> Index:
        """Append rows given as (name, lower, upper) at each place; return their indices (rows, places)."""
        self._bounds += [(lower, upper) for _ in places for _, lower, upper in rows]
        return self.layout.add(table, [name for name, _, _ in rows], places)

    def bound(self, index: int, lower: float, upper: float) -> None:
        """Give a row other bounds than its place in the table has."""
        self._bounds[index] = (lower, upper)

    def bounds(self) -> np.ndarray:
        """Return lower and upper bounds, shape (2, size)."""
        return np.array(self._bounds, dtype=float).reshape(-1, 2).T
