"""Transfer of a solution from one NLP to another: another grid, another scheme, another contact sequence.

Tables and rows are matched by their keys and interpolated at equal fractions of a phase.  Unknowns without a
counterpart keep their initial value; multipliers without one are zero.
"""

from collections.abc import Callable, Mapping

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
                rows=tuple(row.label for row in layout.rows[key]),
                values=values[places],
                multipliers=multipliers[places],
                keys=layout.identifiers[key],
            )
            for key, places in layout.tables.items()
        }

    on_bounds, on_rows = outcome.multipliers
    return Solution(
        intervals=transcription.structure.counts,
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
    counts = transcription.structure.counts

    def transfer(tables: Mapping[str, Table], layout: Layout, vector: Array, part: Callable[[Table], Array]) -> Array:
        for key, places in layout.tables.items():
            table = tables.get(layout.names[key])
            if table is None:
                continue
            values, identifiers = part(table), layout.identifiers[key]
            if solution.intervals == counts and values.shape == places.shape and table.keys == identifiers:
                vector[places] = values  # the same grid
                continue
            before = _fractions(key, values.shape[1], solution.intervals)
            after = _fractions(key, places.shape[1], counts)
            for row, identifier, index in zip(layout.rows[key], identifiers, places, strict=True):
                if identifier in table.keys:
                    vector[index] = np.interp(after, before, values[table.keys.index(identifier)])
                    if part is _multipliers and row.kind is not Kind.DYNAMICS:
                        # The multipliers of the other rows are densities in time.
                        vector[index] *= values.shape[1] / places.shape[1]
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
    return solution.intervals == transcription.structure.counts and all(
        name in known
        and known[name].keys == layout.identifiers[key]
        and known[name].values.shape == layout.tables[key].shape
        for key, name in layout.names.items()
    )


def _values(table: Table) -> Array:
    return table.values


def _multipliers(table: Table) -> Array:
    return table.multipliers


def _fractions(key: TableKey, places: int, counts: tuple[int, ...]) -> Array:
    """Return the fractions at which the places of a table are: of the step for its nodes, otherwise of their phase."""
    if key not in NODE_TABLES:
        return np.linspace(0, 1, places)
    pieces = [(i + np.arange(1, count + 1) / count) / len(counts) for i, count in enumerate(counts)]
    return np.concatenate([[0.0], *pieces])
