"""Summary of the gait of a planar robot as plain data, with forces and impulses by contact."""

import dataclasses
from typing import Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.actuator_impulses import ActuatorImpulses
from gaitopt.motion.impact_edge import find_impact_edges
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment
from gaitopt.motion.summary import ledger_facts, plain
from gaitopt.reductions import worst

LEAST_LOAD = 1e-6
"""Normal force, relative to its maximum, below which rounding errors decide the ratio of the forces."""


def summarise_planar(gait: PlanarGait) -> dict[str, Any]:
    """Return the facts of a gait as plain data for JSON, with the keys of :func:`gaitopt.motion.summarise`.

    Parameters
    ----------
    gait : PlanarGait

    Returns
    -------
    dict
        SI units; forces, impulses, slides and margins by contact.

    Examples
    --------
    >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
    >>> from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
    ...     objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
    ...     transcription=Collocation(intervals=10)))
    >>> summarise_planar(gait)["impact"]["outcome"]
    {'foot A': 'free', 'foot B': 'stick', 'hip point': 'free'}
    """
    motion = gait.motion
    solver = dataclasses.asdict(gait.solver)
    violations, warnings, conflicts = (solver.pop(name) for name in ("violations", "warnings", "conflicts"))
    impacts = [event for event in motion.events if event.is_impact]
    data = {
        "status": gait.status.key,
        "hint": gait.status.hint,
        "robot": gait.robot_name,
        "sequence": str(gait.sequence),
        "objective": gait.solver.objective,
        "cost_of_transport": gait.cost_of_transport,
        "speed": gait.speed,
        "step_length": gait.step_length,
        "period": gait.period,
        "design": gait.design,
        "phases": [_phase_facts(motion, segment) for segment in motion.segments],
        "events": [event_facts(motion, event) for event in motion.events],
        "friction_margin": friction_margin(gait),
        "foot_slide": find_slides(gait),
        "depth_below_ground": find_depths(gait),
        "impact": event_facts(motion, impacts[-1]) if impacts else None,
        "energy": ledger_facts(gait.energy),
        "verification": None if gait.verification is None else dataclasses.asdict(gait.verification),
        "proposal": None,
        "certificate": None if gait.certificate is None else dataclasses.asdict(gait.certificate),
        "solver": solver,
        "violations": violations,
        "conflicts": conflicts,
        "warnings": [*warnings, *map(str, find_impact_edges(gait))],
        "problem": gait.problem,
        "versions": gait.versions,
    }
    summary: dict[str, Any] = plain(data)
    return summary


def friction_margin(gait: PlanarGait) -> float:
    """Return the smallest 1 - abs(f_t) / (mu f_n) of the sticking contacts; nan without any.

    Samples nearly without force, at lift-off, are left out; a body with several contacts counts as one.

    Examples
    --------
    >>> friction_margin.__name__
    'friction_margin'
    """
    values, entries = gait.motion.parameters, gait.motion.contact_entries
    limit = values["friction"] * values["static_friction_ratio"]
    margins = []
    for segment in gait.motion.segments:
        bodies: dict[str, list[int]] = {}
        for i, (_, mode) in enumerate(segment.state.modes):
            if mode is Mode.STICK:
                bodies.setdefault(entries[i].body, []).append(i)
        for members in bodies.values():
            tangential, normal = segment.force[members].sum(axis=0)
            loaded = normal > LEAST_LOAD * normal.max(initial=0.0)
            margins.append(1 - np.abs(tangential[loaded]) / (limit * normal[loaded]))
    return float(np.concatenate(margins).min()) if margins else float("nan")


def find_depths(gait: PlanarGait) -> dict[str, float]:
    """Return the largest depth of each foot below the ground while it swings [m]; 0 if it is never below.

    Examples
    --------
    >>> find_depths.__name__
    'find_depths'
    """
    motion = gait.motion
    feet = [i for i, entry in enumerate(motion.contact_entries) if not entry.is_stop]
    depths = {motion.contacts[i]: 0.0 for i in feet}
    for segment in motion.segments:
        for i in feet:
            if segment.state.modes[i][1] is Mode.FREE:
                name = motion.contacts[i]
                depths[name] = worst(depths[name], -segment.kinematics.gap[i])
    return depths


def find_support(gait: PlanarGait, contact: str) -> str:
    """Return the closed contact of the same body where an open contact is deepest below the ground; empty without one.

    Examples
    --------
    >>> find_support.__name__
    'find_support'
    """
    entries, lowest, support = gait.motion.contact_entries, 0.0, ""
    place = gait.motion.contacts.index(contact)
    members = [i for i, entry in enumerate(entries) if entry.body == entries[place].body and i != place]
    for segment in gait.motion.segments:
        modes = [mode for _, mode in segment.state.modes]
        gap = float(segment.kinematics.gap[place].min())
        if modes[place] is Mode.FREE and gap < lowest:
            closed = (gait.motion.contacts[i] for i in members if modes[i] is not Mode.FREE)
            lowest, support = gap, next(closed, "")
    return support


def _phase_facts(motion: PlanarMotion, segment: PlanarSegment) -> dict[str, Any]:
    closed = [i for i, (_, mode) in enumerate(segment.state.modes) if mode is not Mode.FREE]
    return {
        "mode": ", ".join(f"{motion.contacts[i]} {segment.state.modes[i][1].value}" for i in closed) or "flight",
        "modes": {name: mode.value for name, mode in segment.state.modes},
        "duration": segment.time[-1] - segment.time[0],
        "largest_normal_force": {motion.contacts[i]: segment.force[i, 1].max() for i in closed},
        "largest_tangential_force": {motion.contacts[i]: np.abs(segment.force[i, 0]).max() for i in closed},
    }


def event_facts(motion: PlanarMotion, event: PlanarEvent) -> dict[str, Any]:
    """Return an event as plain data, with the impulse by contact [N s]."""
    received = np.flatnonzero(event.impulse.any(axis=1))
    outcome = event.outcome or event.after
    return {
        "time": event.time,
        "names": list(event.names),
        "outcome": {name: mode.value for name, mode in outcome.modes},
        "mode": {motion.contacts[i]: outcome.modes[i][1].value for i in received},
        "ratio": {motion.contacts[i]: t / n if n else None for i, (t, n) in enumerate(event.impulse) if i in received},
        "impulse": {motion.contacts[i]: event.impulse[i].tolist() for i in received},
        "energy_lost": event.energy_lost,
        "actuator_impulses": [_impulse_facts(motion, stage) for stage in event.actuator_impulses],
        "velocity_after": dict(zip(motion.coordinates, event.v_plus.tolist(), strict=True)),
    }


def _impulse_facts(motion: PlanarMotion, stage: ActuatorImpulses) -> dict[str, Any]:
    """Return simultaneous impulses of actuators as plain data [N s or N m s, J]."""
    acting = np.flatnonzero(stage.impulse)
    values = {"impulse": stage.impulse, "generated": stage.generated, "absorbed": stage.absorbed}
    by_actuator = {name: {motion.actuators[i]: column[i].item() for i in acting} for name, column in values.items()}
    received = np.flatnonzero(stage.reaction.any(axis=1))
    return {
        "moment": stage.moment,
        **by_actuator,
        "reaction": {motion.contacts[i]: stage.reaction[i].tolist() for i in received},
    }


def find_slides(gait: PlanarGait) -> dict[str, float]:
    """Return the distance by which each contact that slips slides, forward positive [m]."""
    slides: dict[str, float] = {}
    for segment in gait.motion.segments:
        for i, (name, mode) in enumerate(segment.state.modes):
            if mode.slips:
                slide = segment.kinematics.slide[i]
                slides[name] = slides.get(name, 0.0) + float(slide[-1] - slide[0])
    return slides
