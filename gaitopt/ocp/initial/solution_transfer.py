"""Carrying a solution from one programme to another: another grid, another scheme, another contact sequence.

Tables of the same name are matched, row by row where the rows have the same names; along a phase they are interpolated
at equal fractions.  What has no counterpart keeps its start (unknowns) or is zero (multipliers).
"""

from collections.abc import Callable, Mapping

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.solution import Solution, Table
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.transcription.phase_constraints import DYNAMICS
from gaitopt.ocp.transcription.transcription import NODE_TABLES, Transcription


def solution_of(transcription: Transcription, outcome: NlpResult) -> Solution:
    """Return the outcome of a solve as named tables."""

    def tables(layout: Layout, values: Array, multipliers: Array) -> dict[str, Table]:
        return {
            name: Table(layout.rows[name], values[places], multipliers[places])
            for name, places in layout.tables.items()
        }

    on_bounds, on_rows = outcome.multipliers
    return Solution(
        intervals=transcription.structure.counts,
        unknowns=tables(transcription.variables, outcome.x, on_bounds),
        constraints=tables(transcription.constraints, outcome.g, on_rows),
    )


def transfer_solution(solution: Solution, transcription: Transcription, x: Array) -> tuple[Array, tuple[Array, Array]]:
    """Return a start and multipliers for a programme.

    Parameters
    ----------
    solution : Solution
    transcription : Transcription
    x : (n_variables,) array
        Start of what the solution does not have.
    """
    counts = transcription.structure.counts

    def laid(tables: Mapping[str, Table], layout: Layout, found: Array, part: Callable[[Table], Array]) -> Array:
        for name, places in layout.tables.items():
            if name not in tables:
                continue
            table, own = tables[name], part(tables[name])
            if solution.intervals == counts and own.shape == places.shape and table.rows == layout.rows[name]:
                found[places] = own  # nothing to interpolate
                continue
            before = _fractions(name, own.shape[1], solution.intervals)
            after = _fractions(name, places.shape[1], counts)
            for row, index in enumerate(places):
                label = layout.rows[name][row]
                if label in table.rows:
                    found[index] = np.interp(after, before, own[table.rows.index(label)])
                    if part is _multipliers and not label.startswith(DYNAMICS):
                        found[index] *= own.shape[1] / places.shape[1]  # they are densities in time
        return found

    zero = np.zeros_like(x)
    return laid(solution.unknowns, transcription.variables, x.copy(), _values), (
        laid(solution.unknowns, transcription.variables, zero, _multipliers),
        laid(solution.constraints, transcription.constraints, np.zeros(transcription.constraints.size), _multipliers),
    )


def covers_transcription(solution: Solution, transcription: Transcription) -> bool:
    """Return whether a solution has a value for every unknown of a programme."""
    layout, known = transcription.variables, solution.unknowns
    return all(name in known and set(rows) <= set(known[name].rows) for name, rows in layout.rows.items())


def _values(table: Table) -> Array:
    return table.values


def _multipliers(table: Table) -> Array:
    return table.multipliers


def _fractions(name: str, places: int, counts: tuple[int, ...]) -> Array:
    """Return where the places of a table are: along the step for nodes of all phases, else along their phase."""
    if name not in NODE_TABLES:
        return np.linspace(0, 1, places)
    pieces = [(i + np.arange(1, count + 1) / count) / len(counts) for i, count in enumerate(counts)]
    return np.concatenate([[0.0], *pieces])
