"""Contacts that would close before the planned touchdown, such as a foot that reaches the ground while armed."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_bounds import conditional_contacts
from gaitopt.ocp.multicontact.planar_plan import SampledPlan, sample_phase
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.keys import Group, Kind, Unknown

BISECTIONS = 40
"""Number of bisections that locate the zero of a gap."""

BELOW = 1e-9
"""Depth [m] from which a contact is below the ground."""


def find_early_touchdowns(plan: SampledPlan, clearance: float) -> dict[int, float]:
    """Return the rows of the gaps that are negative after a contact has touched down too early, and their bounds.

    A contact touches down if its gap decreases through zero while its arming condition is positive; it then counts as
    below the ground, also in the following phases, until its gap is positive.  The bounds are the clearance, and
    decrease to zero in the last quarter of the phase.

    Parameters
    ----------
    plan : SampledPlan
    clearance : float [m]
    """
    transcription, robot, p = plan.transcription, plan.robot, plan.robot.vector(plan.values)
    rows, below = dict[int, float](), set[int]()
    for phase in transcription.phases:
        part, (q, v, _, _) = sample_phase(transcription, phase, plan.x)
        duration = plan.x[transcription.variables[Unknown.DURATION][0, phase.number]]
        curve = CubicHermiteSpline(duration * part, q, v, axis=1)
        gaps = np.array(robot.gaps.map(part.size)(q, p)[0])
        for i in conditional_contacts(robot):
            gap = gaps[i, :-1] if i in phase.closing() else gaps[i]
            if phase.state[i] is not Mode.FREE:
                below.discard(i)
                continue
            falling = np.flatnonzero((gap[:-1] > -BELOW) & (gap[1:] < -BELOW)).tolist()
            first = next((k for k in falling if _is_armed(robot, p, i, curve, curve.x[k : k + 2])), gap.size)
            if i in below and gap[0] < -BELOW:
                first = 0  # the first sample is the last one of the previous phase
            for k in range(first + 1, gap.size):
                row = row_of(transcription, phase, i, k)
                least = clearance * share_of_clearance(transcription, row)
                if gap[k] < least:
                    rows[row] = least
            if first < gap.size and gap[-1] < -BELOW:
                below.add(i)
    return rows


def _is_armed(robot: PlanarRobot, p: Array, contact: int, curve: CubicHermiteSpline, span: Array) -> bool:
    """Return whether a contact is armed where its gap falls through zero in a time span."""
    begin, end = span
    for _ in range(BISECTIONS):
        middle = (begin + end) / 2
        above = float(robot.gaps(curve(middle), p)[0][contact]) > 0
        begin, end = (middle, end) if above else (begin, middle)
    return float(robot.arming(curve(begin), curve(begin, 1), p)[contact]) > 0


def share_of_clearance(transcription: PlanarTranscription, row: int) -> float:
    """Return the bound of the gap in a row after an early touchdown, as a fraction of the clearance.

    Parameters
    ----------
    transcription : PlanarTranscription
    row : int
    """
    place, key = transcription.constraints.entries[row]
    part = ((place.node or 0) + float(transcription.structure.scheme.fractions[key.inner])) / (
        transcription.phases[place.phase or 0].count
    )
    return min(1.0, 4 * (1 - part))


def row_of(transcription: PlanarTranscription, phase: GridPhase, contact: int, sample: int) -> int:
    """Return the row of the gap of a contact at a sample of a phase.

    Parameters
    ----------
    transcription : PlanarTranscription
    phase : GridPhase
    contact, sample : int
    """
    layout, name = transcription.constraints, transcription.structure.robot.contact_names[contact]
    interval, inner = divmod(sample, transcription.structure.scheme.points - 1)
    table = (Group.INTERVAL, phase.number)
    if interval == phase.count:
        table, interval = (Group.END, phase.number), 0
    place = next(
        i for i, key in enumerate(layout.rows[table]) if key.kind is Kind.GAP and key.of == name and key.inner == inner
    )
    return int(layout[table][place, interval])
