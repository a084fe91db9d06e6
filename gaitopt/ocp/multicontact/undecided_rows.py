"""Rows of the gaps that keep grazing contacts of a plan above the ground."""

from collections.abc import Sequence

import numpy as np

from gaitopt.motion.undecided_touchdowns import UndecidedTouchdown
from gaitopt.ocp.multicontact.early_touchdown import row_of, share_of_clearance
from gaitopt.ocp.multicontact.planar_plan import SampledPlan


def find_rows_beside(plan: SampledPlan, undecided: Sequence[UndecidedTouchdown], clearance: float) -> dict[int, float]:
    """Return the rows of the gaps of grazing contacts at the samples before and after each graze, and their bounds.

    The bounds are those after an early touchdown: a graze between two samples is not prevented by a gap of zero there.
    A contact that passes through the ground as it is armed has no rows: a larger gap may be impossible there.

    Parameters
    ----------
    plan : SampledPlan
    undecided : sequence of UndecidedTouchdown
    clearance : float [m]
    """
    rows = dict[int, float]()
    for graze in undecided:
        if graze.at_arming:
            continue
        phase, part = plan.transcription.phases[graze.part], plan.parts[graze.part]
        i = plan.robot.contact_index(graze.contact)
        after = int(np.searchsorted(part.time, graze.time))
        for k in {after - 1, after} & set(range(1, part.time.size - (i in part.closing))):
            row = row_of(plan.transcription, phase, i, k)
            rows[row] = clearance * share_of_clearance(plan.transcription, row)
    return rows
