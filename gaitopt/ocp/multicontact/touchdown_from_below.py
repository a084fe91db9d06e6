"""Contacts of a plan that are below the ground while they are armed, and the rows that exclude such touchdowns."""

from collections.abc import Sequence

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.ground_penetration import Penetration, SampledPart, find_penetrations_of_parts
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.early_touchdown import row_of, share_of_clearance
from gaitopt.ocp.multicontact.planar_plan import sample_phase
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.keys import Unknown


def find_planned_penetrations(
    transcription: PlanarTranscription, values: dict[str, float], x: Array
) -> list[Penetration]:
    """Return the contacts of a plan that are below the ground while armed, with one entry for each swing.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    return find_penetrations_of_parts(transcription.structure.robot, values, sample_phases(transcription, x))


def find_rows_below(
    transcription: PlanarTranscription,
    values: dict[str, float],
    x: Array,
    penetrations: Sequence[Penetration],
    clearance: float,
) -> dict[int, float]:
    """Return the rows of the gaps of contacts that touch down from below, and their bounds.

    The bounds are those after an early touchdown, and zero at the last sample before the contact is below and armed.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    penetrations : sequence of Penetration
    clearance : float [m]
    """
    robot, parts, rows = transcription.structure.robot, sample_phases(transcription, x), dict[int, float]()
    p, times = robot.vector(values), np.concatenate([part.time for part in parts])
    for penetration in penetrations:
        i, start = robot.contact_index(penetration.contact), times[times < penetration.begin].max(initial=0.0)
        for phase, part in zip(transcription.phases, parts, strict=True):
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


def find_highest_rows(
    transcription: PlanarTranscription, values: dict[str, float], x: Array, penetrations: Sequence[Penetration]
) -> list[int]:
    """Return the rows of the largest gaps of contacts after they were below the ground and armed.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    penetrations : sequence of Penetration
    """
    robot, parts, rows = transcription.structure.robot, sample_phases(transcription, x), list[int]()
    p = robot.vector(values)
    for penetration in penetrations:
        i, gaps = robot.contact_index(penetration.contact), dict[int, float]()
        for phase, part in zip(transcription.phases, parts, strict=True):
            if part.time[-1] <= penetration.deepest or part.modes[i] is not Mode.FREE:
                continue
            gap = np.array(robot.gaps.map(part.time.size)(part.q, p)[0])[i]
            for k in range(1, gap.size - (i in part.closing)):  # the first sample is the last one of the previous phase
                if part.time[k] > penetration.deepest:
                    gaps[row_of(transcription, phase, i, k)] = float(gap[k])
            if i in part.closing:
                break
        if gaps:
            rows.append(max(gaps, key=gaps.__getitem__))
    return rows


def sample_phases(transcription: PlanarTranscription, x: Array) -> list[SampledPart]:
    """Return the samples of all phases of a plan.

    Parameters
    ----------
    transcription : PlanarTranscription
    x : (n_variables,) array
        Decision vector.
    """
    parts, begin = list[SampledPart](), 0.0
    for phase in transcription.phases:
        fractions, (q, v, _, _) = sample_phase(transcription, phase, x)
        time = begin + float(x[transcription.variables[Unknown.DURATION][0, phase.number]]) * fractions
        parts.append(SampledPart(tuple(phase.state), time, q, v, frozenset(phase.closing())))
        begin = float(time[-1])
    return parts
