"""Touchdowns of a plan that rounding errors decide, and the rows that keep grazing contacts above the ground."""

from collections.abc import Sequence

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.undecided_touchdowns import UndecidedTouchdown, find_undecided_touchdowns_of_parts
from gaitopt.ocp.multicontact.early_touchdown import row_of, share_of_clearance
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.multicontact.touchdown_from_below import sample_phases


def find_undecided_in_plan(
    transcription: PlanarTranscription, values: dict[str, float], x: Array
) -> list[UndecidedTouchdown]:
    """Return the touchdowns of a plan that rounding errors decide.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    return find_undecided_touchdowns_of_parts(transcription.structure.robot, values, sample_phases(transcription, x))


def find_rows_beside(
    transcription: PlanarTranscription, x: Array, undecided: Sequence[UndecidedTouchdown], clearance: float
) -> dict[int, float]:
    """Return the rows of the gaps of grazing contacts at the samples before and after each graze, and their bounds.

    The bounds are those after an early touchdown: a graze between two samples is not prevented by a gap of zero there.
    A contact that passes through the ground as it is armed has no rows: a larger gap may be impossible there.

    Parameters
    ----------
    transcription : PlanarTranscription
    x : (n_variables,) array
        Decision vector.
    undecided : sequence of UndecidedTouchdown
    clearance : float [m]
    """
    parts, rows = sample_phases(transcription, x), dict[int, float]()
    for graze in undecided:
        if graze.at_arming:
            continue
        phase, part = transcription.phases[graze.part], parts[graze.part]
        i = transcription.structure.robot.contact_index(graze.contact)
        after = int(np.searchsorted(part.time, graze.time))
        for k in {after - 1, after} & set(range(1, part.time.size - (i in part.closing))):
            row = row_of(transcription, phase, i, k)
            rows[row] = clearance * share_of_clearance(transcription, row)
    return rows
