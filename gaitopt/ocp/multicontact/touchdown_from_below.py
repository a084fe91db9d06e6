"""Rows of the gaps that exclude touchdowns of contacts that are below the ground while they are armed."""

from collections.abc import Sequence

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.ground_penetration import Penetration
from gaitopt.ocp.multicontact.early_touchdown import row_of, share_of_clearance
from gaitopt.ocp.multicontact.planar_plan import SampledPlan


def find_rows_below(plan: SampledPlan, penetrations: Sequence[Penetration], clearance: float) -> dict[int, float]:
    """Return the rows of the gaps of contacts that touch down from below, and their bounds.

    The bounds are those after an early touchdown, and zero at the last sample before the contact is below and armed.

    Parameters
    ----------
    plan : SampledPlan
    penetrations : sequence of Penetration
    clearance : float [m]
    """
    transcription, robot, p, rows = plan.transcription, plan.robot, plan.robot.vector(plan.values), dict[int, float]()
    times = np.concatenate([part.time for part in plan.parts])
    for penetration in penetrations:
        i, start = robot.contact_index(penetration.contact), times[times < penetration.begin].max(initial=0.0)
        for phase, part in zip(transcription.phases, plan.parts, strict=True):
            if part.time[-1] < start or part.modes[i] is not Mode.FREE:
                continue
            gap = np.array(robot.gaps.map(part.time.size)(part.q, p)[0])[i]
            for k in range(1, gap.size - (i in part.closing)):  # the first sample is the last one of the previous phase
                row = row_of(transcription, phase, i, k)
                least = clearance * share_of_clearance(transcription, row) if part.time[k] >= penetration.begin else 0.0
                if part.time[k] >= start and gap[k] < least:
                    rows[row] = least
            if i in part.closing:
                break
    return rows


def find_highest_rows(plan: SampledPlan, penetrations: Sequence[Penetration]) -> list[int]:
    """Return the rows of the largest gaps of contacts after they were below the ground and armed.

    Parameters
    ----------
    plan : SampledPlan
    penetrations : sequence of Penetration
    """
    robot, p, rows = plan.robot, plan.robot.vector(plan.values), list[int]()
    for penetration in penetrations:
        i, gaps = robot.contact_index(penetration.contact), dict[int, float]()
        for phase, part in zip(plan.transcription.phases, plan.parts, strict=True):
            if part.time[-1] <= penetration.deepest or part.modes[i] is not Mode.FREE:
                continue
            gap = np.array(robot.gaps.map(part.time.size)(part.q, p)[0])[i]
            for k in range(1, gap.size - (i in part.closing)):  # the first sample is the last one of the previous phase
                if part.time[k] > penetration.deepest:
                    gaps[row_of(plan.transcription, phase, i, k)] = float(gap[k])
            if i in part.closing:
                break
        if gaps:
            rows.append(max(gaps, key=gaps.__getitem__))
    return rows
