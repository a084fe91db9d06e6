"""Remarks on a plan of a robot with several contacts: why it is inaccurate, and phases of minimum duration."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.keys import Place, Unknown


def report_inaccuracy(transcription: PlanarTranscription, problem: PlanarProblem, errors: Array, ending: str) -> str:
    """Return a sentence that states in which phase a plan is inaccurate, and how its refinement ended.

    Parameters
    ----------
    transcription : PlanarTranscription
    problem : PlanarProblem
    errors : (n_phases,) array
        Error between nodes of each phase.
    ending : str
        How the solve on a finer grid ended; empty if there was none.
    """
    worst = transcription.phases[int(np.argmax(np.where(np.isnan(errors), np.inf, errors)))]
    reason = f"a finer grid has no solution ({ending})" if ending else "the grid is not refined further"
    return (
        f"the error between nodes of {worst.place().label} is {errors[worst.number]:.1e} on {worst.count} intervals, "
        f"but the tolerance is {problem.transcription.tolerance:.1e}, and {reason}: use more intervals in this phase, "
        "a guess near a plausible motion, or PlanarLimits.coordinate, which excludes postures outside its ranges."
    )


def report_early_touchdowns(
    transcription: PlanarTranscription, rows: Mapping[int, float], x: Array, g: Array
) -> tuple[str, ...]:
    """Return a sentence for each contact that touches the ground before its planned touchdown.

    Parameters
    ----------
    transcription : PlanarTranscription
    rows : mapping of int to float
        As :func:`~gaitopt.ocp.multicontact.early_touchdown.find_early_touchdowns` returns them, in order of time.
    x, g : (n_variables,), (n_constraints,) arrays
        Unknowns and rows of the plan.
    """
    sections: dict[tuple[str, Place], list[int]] = {}
    for row in rows:
        place, key = transcription.constraints.entries[row]
        sections.setdefault((key.of, replace(place, node=None, between=False)), []).append(row)
    return tuple(
        f"contact {contact!r} touches the ground in {place.label}, at {_time_of(transcription, members[0], x):.4g} s, "
        f"before its planned touchdown, with a least gap of {float(g[members].min()):.2g}, and a replay ends the step "
        "there: arm it later (`armed` of the contact), or change PlanarLimits.clearance, step length or speed."
        for (contact, place), members in sections.items()
    )


def _time_of(transcription: PlanarTranscription, row: int, x: Array) -> float:
    """Return the time of a row of an interval, from the start of the period [s]."""
    place, key = transcription.constraints.entries[row]
    durations, number = x[transcription.variables[Unknown.DURATION][0]], place.phase or 0
    part = (place.node or 0) + float(transcription.structure.scheme.fractions[key.inner])
    return float(durations[:number].sum() + durations[number] * part / transcription.phases[number].count)


def report_shortest_phases(transcription: PlanarTranscription, problem: PlanarProblem, x: Array) -> tuple[str, ...]:
    """Return a sentence for each phase of minimum duration."""
    shortest = problem.limits.shortest_phase
    durations = x[transcription.variables[Unknown.DURATION][0]]
    return tuple(
        f"{phase.place().label} lasts {shortest:g} s, the minimum (PlanarLimits.shortest_phase): a sequence without "
        "this phase may have a lower cost, and so may another guess."
        for phase, duration in zip(transcription.phases, durations, strict=True)
        if duration < 1.01 * shortest
    )
