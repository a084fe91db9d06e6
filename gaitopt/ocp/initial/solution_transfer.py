"""Transfer of a solution from one NLP to another: another grid, another scheme, another contact sequence.

Tables and rows are matched by their keys and interpolated at equal fractions of a phase.  Unknowns without a
counterpart keep their initial value; multipliers without one are zero.
"""

from collections.abc import Callable, Mapping

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.ocp.initial.motion_transfer import transfer_motion
from gaitopt.ocp.initial.multiplier_transfer import GridPlaces, transfer_multipliers
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.transcription.transcription import Transcription


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


def transfer_solution(
    solution: Solution, transcription: Transcription, x: Array, *, accurate: bool = True
) -> tuple[Array, tuple[Array, Array]]:
    """Return the initial point and the multipliers of an NLP from a solution.

    Parameters
    ----------
    solution : Solution
    transcription : Transcription
    x : (n_variables,) array
        Initial values of the unknowns that the solution lacks.
    accurate : bool
        Whether the motion is transferred with its accelerations, and multipliers at their instants, so that the point
        nearly solves the NLP.  Otherwise all are interpolated between the nodes.
    """
    same = _has_same_nodes(solution, transcription)
    inner = transcription.structure.scheme.fractions
    before = GridPlaces(solution.intervals, solution.fractions, inner)
    after = GridPlaces(transcription.structure.counts, _node_fractions(transcription), inner)
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
                    if part is _multipliers and accurate:
                        vector[index] = transfer_multipliers(key, row, old, before, after, index.size)
                    elif part is _multipliers and row.kind is not Kind.DYNAMICS:  # densities in time
                        vector[index] = np.interp(new_at, at, old / widths) * new_widths
                    else:
                        vector[index] = np.interp(new_at, at, old)
        return vector

    zero, point = np.zeros_like(x), transfer(solution.unknowns, transcription.variables, x.copy(), _values)
    if accurate and not has_same_grid(solution, transcription):
        transfer_motion(solution, transcription, point)
    return point, (
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


def has_same_grid(solution: Solution, transcription: Transcription, *, moved: bool = False) -> bool:
    """Return whether a solution has the unknowns of an NLP on the same grid, whose nodes may be `moved`."""
    layout, known = transcription.variables, solution.unknowns
    same = solution.intervals == transcription.structure.counts if moved else _has_same_nodes(solution, transcription)
    return same and all(
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
