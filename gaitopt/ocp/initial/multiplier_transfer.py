"""Transfer of multipliers between grids.

The multipliers of conditions that hold along a phase are densities in time: on a finer grid each is smaller in
proportion to the interval it stands for.  Those of the dynamics are costates, at the ends of the intervals.  Those of
conditions at an instant, such as a foot at rest, do not depend on the grid.
"""

import functools

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Group, Key, Kind, TableKey, Unknown
from gaitopt.ocp.transcription.transcription import NODE_TABLES


@dataclass(frozen=True)
class GridPlaces:
    """Places of the columns of tables on a grid.

    Attributes
    ----------
    intervals : tuple of int
        Number of intervals of each phase.
    fractions : tuple of tuple of float, optional
        Fractions of the phases at which the nodes are; None for equal intervals.
    inner : (s,) array
        Fractions of an interval at which its points are, the first of which is its node.
    """

    intervals: tuple[int, ...]
    fractions: tuple[tuple[float, ...], ...] | None
    inner: Array

    def places(self, key: TableKey, count: int, *, equal: bool = False) -> tuple[Array, Array]:
        """Return the fractions at which the places of a table are, and the widths of their neighbourhoods.

        Both are fractions of the step for its nodes, otherwise of their phase.  With `equal`, the intervals of each
        phase are equal before and after.
        """
        if key in NODE_TABLES:
            nodes = [at + i for i, at in enumerate(self._phases)]
            places = np.concatenate([nodes[0], *(at[1:] for at in nodes[1:])]) / len(self.intervals)
            return places, np.full(count, 1 / count) if equal else _widths(places)
        phase = None if equal else self._phase_of(key)
        if phase is not None and count == phase.size:
            return phase, _widths(phase)
        if phase is not None and count == phase.size - 1:
            return (phase[1:] + phase[:-1]) / 2, np.diff(phase)
        return np.linspace(0, 1, count), np.full(count, 1 / count)

    def instants(self, number: int, row: Key) -> tuple[Array, Array]:
        """Return the fractions of a phase at which a row of its intervals holds, and the lengths it stands for."""
        nodes = self._phases[number]
        lengths = np.diff(nodes)
        shared = lengths if row.inner else lengths + np.concatenate([[0.0], lengths[:-1]])
        return nodes[:-1] + self.inner[row.inner] * lengths, shared

    def ends(self, number: int) -> Array:
        """Return the fractions of a phase at which its intervals end."""
        return self._phases[number][1:]

    @functools.cached_property
    def _phases(self) -> list[Array]:
        """The fractions of each phase at which its nodes are."""
        if self.fractions is not None:
            return [np.array(at) for at in self.fractions]
        return [np.linspace(0, 1, count + 1) for count in self.intervals]

    def _phase_of(self, key: TableKey) -> Array | None:
        """Return the nodes of the phase of a table; None for a table of the step."""
        number = key[1] if isinstance(key, tuple) else None
        return self._phases[number] if number is not None and number < len(self.intervals) else None


def _widths(nodes: Array) -> Array:
    """Return the mean lengths of the intervals on both sides of each node; of the only one at an end."""
    lengths = np.diff(nodes)
    return (np.append(lengths[0], lengths) + np.append(lengths, lengths[-1])) / 2


def transfer_multipliers(
    key: TableKey, row: Key, multipliers: Array, before: GridPlaces, after: GridPlaces, count: int
) -> Array:
    """Return the multipliers of a row, or of the bounds of an unknown, on another grid, shape (count,).

    Parameters
    ----------
    key : TableKey
    row : Key
    multipliers : (n_places,) array
        On the grid before.
    before, after : GridPlaces
    count : int
        Number of places on the grid after.
    """
    table, number = key if isinstance(key, tuple) else (key, 0)
    if table is Group.INTERVAL and row.kind is Kind.DYNAMICS:
        return _extrapolate(after.ends(number), before.ends(number), multipliers)
    if table is Group.INTERVAL and row.inner < min(before.inner.size, after.inner.size):
        (at, lengths), (new_at, new_lengths) = (grid.instants(number, row) for grid in (before, after))
        return np.interp(new_at, at, multipliers / lengths) * new_lengths
    if table in (Group.START, Group.END):
        return multipliers
    (at, widths), (new_at, new_widths) = before.places(key, multipliers.size), after.places(key, count)
    if table is not Unknown.SLIDE:
        return np.interp(new_at, at, multipliers / widths) * new_widths
    # The slide is zero at the start of its phase, and its speed is zero where the foot comes to rest.
    inside = np.interp(new_at, at[1:-1], (multipliers / widths)[1:-1]) * new_widths
    return np.concatenate([multipliers[:1], inside[1:-1], multipliers[-1:]])


def _extrapolate(new_at: Array, at: Array, values: Array) -> Array:
    """Return values interpolated between places, and extrapolated linearly before the first one."""
    slope = (values[1] - values[0]) / (at[1] - at[0])
    return np.interp(new_at, at, values) + np.minimum(new_at - at[0], 0.0) * slope
