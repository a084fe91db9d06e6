"""Carrying a solution from one transcription to another: another grid, another scheme, another word.

Tables of the same name are matched; along a phase they are interpolated at equal fractions, row by row where the rows
have the same names.  What has no counterpart keeps its start (unknowns) or is zero (multipliers).
"""

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.ipopt import Outcome
from gaitopt.ocp.layout import Layout
from gaitopt.ocp.transcription import Transcription


def carried(before: Transcription, outcome: Outcome, after: Transcription) -> tuple[Array, tuple[Array, Array]]:
    """Return a start and multipliers for a transcription from the outcome of another one."""
    on_bounds, on_rows = outcome.multipliers
    x = _mapped(before.variables, outcome.x, after.variables)
    return x, (
        _mapped(before.variables, on_bounds, after.variables),
        _mapped(before.constraints, on_rows, after.constraints),
    )


def _mapped(old: Layout, values: Array, new: Layout) -> Array:
    """Return values laid out anew."""
    found = np.zeros(new.size)
    for name, places in new.tables.items():
        if name not in old:
            continue
        own = values[old[name]]
        old_names = [old.labels[i][1] for i in old[name][:, 0]]
        new_names = [new.labels[i][1] for i in places[:, 0]]
        for row, label in enumerate(new_names):
            if label in old_names:
                series = own[old_names.index(label)]
                at = np.linspace(0, series.size - 1, places.shape[1])
                found[places[row]] = np.interp(at, np.arange(series.size), series)
    return found
