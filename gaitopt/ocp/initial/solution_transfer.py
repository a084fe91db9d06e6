"""Transfer of a solution from one NLP to another: another grid, another scheme, another contact sequence.

Tables and rows are matched by their keys and interpolated at equal fractions of a phase.  Unknowns without a
counterpart keep their initial value; multipliers without one are zero.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.ocp.nlp.keys import Kind, TableKey
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.transcription.transcription import NODE_TABLES, Transcription


def solution_of(transcription: Transcription, outcome: NlpResult) -> Solution:
    """Return the result of a solve as named tables."""

    def tables(layout: Layout, values: Array, multipliers: Array) -> dict[str, Table]:
        return {
            layout.names[key]: Table(
                rows=layout.labels_of_rows[key],
                values=values[places],
                multipliers=multipliers[places],
                keys=layout.identifiers[key],
            )
            for key, places in layout.tables.items()
        }

    on_bounds, on_rows = outcome.multipliers
    return Solution(
        intervals=transcription.structure.counts,
        fractions=_node_fractions(transcription),
        unknowns=tables(transcription.variables, outcome.x, on_bounds),
        constraints=tables(transcription.constraints, outcome.g, on_rows),
    )


def transfer_solution(solution: Solution, transcription: Transcription, x: Array) -> tuple[Array, tuple[Array, Array]]:
    """Return the initial point and the multipliers of an NLP from a solution.

    Parameters
    ----------
    solution : Solution
    transcription : Transcription
    x : (n_variables,) array
        Initial values of the unknowns that the solution lacks.
    """
    same = _has_same_nodes(solution, transcription)
    before = _Grid(solution.intervals, solution.fractions)
    after = _Grid(transcription.structure.counts, _node_fractions(transcription))
    equal = before.fractions is None and after.fractions is None

    def transfer(tables: Mapping[str, Table], layout: Layout, vector: Array, part: Callable[[Table], Array]) -> Array:
        for key, places in layout.tables.items():
            table = tables.get(layout.names[key])
            if table is None:
                continue
            values, identifiers = part(table), layout.identifiers[key]
            if same and values.shape == places.shape and table.keys == identifiers:
                vector[places] = values
                continue
            at, widths = before.places(key, values.shape[1], equal=equal)
            new_at, new_widths = after.places(key, places.shape[1], equal=equal)
            for row, identifier, index in zip(layout.rows[key], identifiers, places, strict=True):
                if identifier in table.keys:
                    old = values[table.keys.index(identifier)]
                    if part is _multipliers and row.kind is not Kind.DYNAMICS:
                        # The multipliers of the other rows are densities in time.
                        vector[index] = np.interp(new_at, at, old / widths) * new_widths
                    else:
                        vector[index] = np.interp(new_at, at, old)
        return vector

    zero = np.zeros_like(x)
    return transfer(solution.unknowns, transcription.variables, x.copy(), _values), (
        transfer(solution.unknowns, transcription.variables, zero, _multipliers),
        transfer(
            solution.constraints, transcription.constraints, np.zeros(transcription.constraints.size), _multipliers
        ),
    )


def covers_transcription(solution: Solution, transcription: Transcription) -> bool:
    """Return whether a solution has a value for every unknown of an NLP."""
    layout, known = transcription.variables, solution.unknowns
    return all(
        name in known and set(layout.identifiers[key]) <= set(known[name].keys) for key, name in layout.names.items()
    )


def has_same_grid(solution: Solution, transcription: Transcription) -> bool:
    """Return whether a solution has the unknowns of an NLP, on the same grid."""
    layout, known = transcription.variables, solution.unknowns
    return _has_same_nodes(solution, transcription) and all(
        name in known
        and known[name].keys == layout.identifiers[key]
        and known[name].values.shape == layout.tables[key].shape
        for key, name in layout.names.items()
    )


def _values(table: Table) -> Array:
    return table.values


def _multipliers(table: Table) -> Array:
    return table.multipliers


def _node_fractions(transcription: Transcription) -> tuple[tuple[float, ...], ...] | None:
    """Return the fractions of the phases at which their nodes are; None for equal intervals."""
    if not transcription.structure.placed:
        return None
    return tuple(tuple(phase.fractions.tolist()) for phase in transcription.phases)


def _has_same_nodes(solution: Solution, transcription: Transcription) -> bool:
    """Return whether a solution has the nodes of a transcription."""
    same = solution.fractions == _node_fractions(transcription)
    return solution.intervals == transcription.structure.counts and same


@dataclass(frozen=True)
class _Grid:
    """Intervals of each phase, and fractions of the phases at which the nodes are; None for equal intervals."""

    intervals: tuple[int, ...]
    fractions: tuple[tuple[float, ...], ...] | None

    def places(self, key: TableKey, count: int, *, equal: bool) -> tuple[Array, Array]:
        """Return the fractions at which the places of a table are, and the widths of their neighbourhoods.

        Both are fractions of the step for its nodes, otherwise of their phase.  With `equal`, the intervals of each
        phase are equal before and after.
        """
        if key in NODE_TABLES:
            nodes = [at + i for i, at in enumerate(self._phases())]
            places = np.concatenate([nodes[0], *(at[1:] for at in nodes[1:])]) / len(self.intervals)
            return places, np.full(count, 1 / count) if equal else _widths(places)
        phase = None if equal else self._phase_of(key)
        if phase is not None and count == phase.size:
            return phase, _widths(phase)
        if phase is not None and count == phase.size - 1:
            return (phase[1:] + phase[:-1]) / 2, np.diff(phase)
        return np.linspace(0, 1, count), np.full(count, 1 / count)

    def _phases(self) -> list[Array]:
        if self.fractions is not None:
            return [np.array(at) for at in self.fractions]
        return [np.linspace(0, 1, count + 1) for count in self.intervals]

    def _phase_of(self, key: TableKey) -> Array | None:
        """Return the nodes of the phase of a table; None for a table of the step."""
        number = key[1] if isinstance(key, tuple) else None
        return self._phases()[number] if number is not None and number < len(self.intervals) else None


def _widths(nodes: Array) -> Array:
    """Return the mean lengths of the intervals on both sides of each node; of the only one at an end."""
    lengths = np.diff(nodes)
    return (np.append(lengths[0], lengths) + np.append(lengths, lengths[-1])) / 2
