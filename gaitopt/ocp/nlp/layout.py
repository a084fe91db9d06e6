"""Layout of the decision and constraint vectors: table, row and column of every entry."""

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.ocp.nlp.keys import Key, Kind, Place, Row, TableKey, label, table_name

Index = NDArray[np.intp]


@dataclass
class Layout:
    """A vector divided into tables; rows of a table are quantities, columns are places along the gait.

    Attributes
    ----------
    size : int
    tables : dict of TableKey to (n_rows, n_places) int array
        Indices of the entries of a table in the vector.
    rows : dict of TableKey to tuple of Key
    names : dict of TableKey to str
        Names of the tables in files.
    labels_of_rows, identifiers : dict of TableKey to tuple of str
        Printed labels of the rows, and their texts in files.
    places : dict of TableKey to tuple of Place

    Examples
    --------
    >>> from gaitopt.ocp.nlp.keys import GROUND, STEP, Unknown
    >>> layout = Layout()
    >>> layout.add(Unknown.ANGLES, [Key(Kind.ANGLE, "th1"), Key(Kind.ANGLE, "th2")], [STEP, GROUND])
    array([[0, 2],
           [1, 3]])
    >>> layout.label(3)
    ('ground', 'th2')
    >>> layout.find(Kind.ANGLE, "th2")
    array([1, 3])
    """

    size: int = 0
    tables: dict[TableKey, Index] = field(default_factory=dict)
    rows: dict[TableKey, tuple[Key, ...]] = field(default_factory=dict)
    names: dict[TableKey, str] = field(default_factory=dict)
    labels_of_rows: dict[TableKey, tuple[str, ...]] = field(default_factory=dict)
    identifiers: dict[TableKey, tuple[str, ...]] = field(default_factory=dict)
    places: dict[TableKey, tuple[Place, ...]] = field(default_factory=dict)
    _entries: list[tuple[Place, Key]] = field(default_factory=list, repr=False)
    _found: dict[tuple[Kind, str | None], Index] = field(default_factory=dict, repr=False)

    def add(self, table: TableKey, rows: Sequence[Key], places: Sequence[Place]) -> Index:
        """Append a table and return its indices, shape (len(rows), len(places))."""
        count = len(rows) * len(places)
        index = np.arange(self.size, self.size + count).reshape(len(places), len(rows)).T
        self.tables[table], self.rows[table], self.places[table] = index, tuple(rows), tuple(places)
        self.names[table], identifiers = table_name(table), tuple(row.identifier for row in rows)
        self.identifiers[table] = identifiers
        self.labels_of_rows[table] = tuple(map(label, rows, identifiers))
        self.size += count
        self._found.clear()
        return index

    def __getitem__(self, table: TableKey) -> Index:
        return self.tables[table]

    def __contains__(self, table: TableKey) -> bool:
        return table in self.tables

    @property
    def entries(self) -> list[tuple[Place, Key]]:
        """Place and quantity of each entry of the vector."""
        if len(self._entries) < self.size:
            tables = self.rows.items()
            self._entries = [(place, row) for table, rows in tables for place in self.places[table] for row in rows]
        return self._entries

    def find(self, kind: Kind, of: str | None = None) -> Index:
        """Return the indices of all quantities of a kind, at nodes and inner points, shape (n,).

        Parameters
        ----------
        kind : Kind
        of : str, optional
            Name of one angle or actuator, to which the search is restricted.
        """
        if (kind, of) not in self._found:
            indices = [
                self.tables[table][i]
                for table, rows in self.rows.items()
                for i, key in enumerate(rows)
                if key.kind is kind and of in (None, key.of)
            ]
            self._found[kind, of] = np.concatenate(indices) if indices else np.empty(0, dtype=np.intp)
            self._found[kind, of].flags.writeable = False
        return self._found[kind, of]

    def label(self, index: int) -> tuple[str, str]:
        """Return the printed labels of an entry: its place and its quantity."""
        place, key = self.entries[index]
        return place.label, key.label

    @property
    def labels(self) -> list[tuple[str, str]]:
        """Labels of all entries."""
        return [self.label(index) for index in range(self.size)]


class Rows:
    """Constraint rows under construction: a layout and the bounds of its rows."""

    def __init__(self) -> None:
        self.layout = Layout()
        self._lower, self._upper = list[float](), list[float]()

    def add(self, table: TableKey, rows: Sequence[Row], places: Sequence[Place]) -> Index:
        """Append rows at each place; return their indices (rows, places)."""
        self._lower += [row.lower for row in rows] * len(places)
        self._upper += [row.upper for row in rows] * len(places)
        return self.layout.add(table, [row.key for row in rows], places)

    def bound(self, index: int, lower: float, upper: float) -> None:
        """Replace the bounds of one entry."""
        self._lower[index], self._upper[index] = lower, upper

    def bounds(self) -> np.ndarray:
        """Return lower and upper bounds, shape (2, size)."""
        return np.array([self._lower, self._upper], dtype=float)
