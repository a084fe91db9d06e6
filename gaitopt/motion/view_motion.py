"""view_motion: the motion of any robot as figures, animations, reports and tables read it.

The only module that distinguishes motions with one foot on the ground from those of robots with several contacts.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gaitopt.lazy import Deferred
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import GAP, SLIDE
from gaitopt.model.ground_frame import place_on_plane
from gaitopt.motion.energy import ledger
from gaitopt.motion.link_roles import assign_links, classify_links, find_joint_points, number_legs
from gaitopt.motion.motion import Jump, Motion, Segment, check_motion
from gaitopt.motion.motion_view import Channel, ContactView, EventView, MotionView, PhaseView, Token, name_modes
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment

AnyMotion = Motion | PlanarMotion | MotionView

LEVEL_TOLERANCE = 1e-9
"""Variation of gap -+ coordinate [m or rad] below which a stop is that of this coordinate."""


def view_motion(motion: AnyMotion, limits: Mapping[str, float] | None = None) -> MotionView:
    """Return a motion as a view.

    Parameters
    ----------
    motion : Motion, PlanarMotion or MotionView
    limits : mapping of str to float, optional
        Limits of the actuators [N m or N].

    Raises
    ------
    InputError
        If `motion` is something else.
    """
    if isinstance(motion, MotionView):
        return motion
    if isinstance(motion, PlanarMotion):
        return _view_several(motion, limits or {})
    check_motion(motion)
    return _view_single(motion, limits or {})


def _view_single(motion: Motion, limits: Mapping[str, float]) -> MotionView:
    """Return the view of a walker with one foot on the ground at a time."""
    roles = classify_links(motion) if motion.segments else None
    legs = {link: leg for leg, links in enumerate((roles.stance, roles.swing)) for link in links} if roles else {}
    swing = roles.swing_foot if roles else 0
    return MotionView(
        coordinates=(Channel("x", "m"), Channel("y", "m"), *(Channel(name, "rad") for name in motion.angles)),
        actuators=tuple(Channel(name, "N m") for name in motion.actuators),
        contacts=(
            ContactView("stance foot", "", leg="stance leg", leg_number=0),
            ContactView("landing foot", "landing_foot_", leg="swing leg", leg_number=1),
        ),
        exchange=(1, 0),
        points=motion.points,
        links=motion.links,
        link_contacts=tuple(legs.get(link) for link in motion.links),
        foot_points={0: roles.stance_foot, 1: roles.swing_foot} if roles else {},
        joints=roles.joints if roles else (),
        parameters=motion.parameters,
        total_mass=motion.total_mass,
        segments=tuple(_single_phase(segment, swing, motion.parameters) for segment in motion.segments),
        events=tuple(_touchdown(jump) for jump in motion.jumps),
        tokens=_single_tokens(motion),
        travel=motion.travel,
        distance_row=SLIDE,
        energy=Deferred(lambda: ledger(motion)),
        limits=limits,
        terrain=motion.terrain,
    )


def _single_phase(segment: Segment, swing: int, parameters: Mapping[str, float]) -> PhaseView:
    zero, place = np.zeros_like(segment.time), segment.points[:, swing]
    if segment.rims is not None:
        place = np.stack([segment.rims[0, 1], segment.rims[1, 1] - segment.rims[2, 1]])
    return PhaseView(
        step=segment.step,
        modes=(segment.mode, Mode.FREE),
        **{name: getattr(segment, name) for name in ("time", "q", "v", "torque", "work", "power", "points", "rims")},
        forces=np.stack([segment.force, np.zeros_like(segment.force)]),
        slides=np.stack([segment.q[SLIDE], zero]),
        slip_speeds=np.stack([segment.v[SLIDE], zero]),
        gaps=np.stack([segment.q[GAP], place[1]]),
        friction_works=np.stack([segment.friction_work, zero]),
        **{name: getattr(segment, name) for name in ("damping_work", "kinetic", "potential", "elastic")},
        places=np.stack([place_on_plane(segment.contact, parameters), place], axis=1),
    )


def _touchdown(jump: Jump) -> EventView:
    impulses = np.stack([jump.impulse, np.zeros(2)])  # drawn as that of the next stance foot
    label = f"touchdown, {jump.mode.label}"
    modes = (jump.mode, Mode.FREE)
    return EventView(step=jump.step, time=jump.time, label=label, is_impact=True, impulses=impulses, modes=modes)


def _single_tokens(motion: Motion) -> tuple[Token, ...]:
    first = [part.mode for part in motion.segments if part.step == motion.segments[0].step]
    tokens = [Token(mode.value, mode, phase) for phase, mode in enumerate(first)]
    impacts = [jump.mode for jump in motion.jumps if jump.step == motion.segments[0].step] if first else []
    return (*tokens, *(token for mode in impacts[:1] for token in (Token("|"), Token(mode.value, mode))))


def _view_several(motion: PlanarMotion, limits: Mapping[str, float]) -> MotionView:
    """Return the view of a robot with several contacts: of those that close, and of their partners in the exchange."""
    kept = _kept_contacts(motion)
    place = {contact: number for number, contact in enumerate(kept)}
    exchange = motion.exchange or tuple(range(len(motion.contacts)))
    lasting = [k for k, segment in enumerate(motion.segments) if segment.time[-1] > segment.time[0]]
    segments = tuple(_planar_phase(motion, motion.segments[k], kept) for k in lasting)
    names = tuple(motion.contacts[i] for i in kept)
    mirrored = tuple(place[exchange[i]] for i in kept)
    bodies = [motion.contact_entries[i].body for i in kept]
    feet = [k for k, i in enumerate(kept) if not motion.contact_entries[i].is_stop]
    legs = number_legs({k: bodies[k] for k in feet}, mirrored)
    contacts = tuple(_contact_view(motion, i, k, legs) for k, i in enumerate(kept))
    foot_points = _foot_points(segments, feet, len(motion.points))
    return MotionView(
        coordinates=tuple(map(Channel, motion.coordinates, motion.units)),
        actuators=tuple(map(Channel, motion.actuators, motion.actuator_units)),
        contacts=contacts,
        exchange=mirrored,
        points=motion.points,
        links=motion.links,
        link_contacts=assign_links(motion.links, foot_points, bodies),
        foot_points=foot_points,
        joints=find_joint_points(motion.links, foot_points.values(), len(motion.points)),
        parameters=motion.parameters,
        total_mass=motion.total_mass,
        segments=segments,
        events=tuple(_planar_event(event, kept) for event in motion.events),
        tokens=_planar_tokens(segments, [motion.events[k] if k < len(motion.events) else None for k in lasting], names),
        travel=motion.distance,
        distance_row=None if motion.travel is None else motion.coordinates.index(motion.travel),
        energy=Deferred(motion.ledger),
        limits=limits,
        terrain=motion.terrain,
    )


def _kept_contacts(motion: PlanarMotion) -> list[int]:
    """Return the contacts that close, and those exchanged with them, in the order of the robot."""
    closed = {name for segment in motion.segments for name in segment.state.closed}
    closed |= {name for event in motion.events for name in (*event.before.closed, *event.after.closed)}
    numbers = {i for i, name in enumerate(motion.contacts) if name in closed}
    partners = {motion.exchange[i] for i in numbers} if motion.exchange else set()
    return sorted(numbers | partners)


def _contact_view(motion: PlanarMotion, contact: int, number: int, legs: Mapping[int, int]) -> ContactView:
    """Return a contact, named as in the robot; a leg with several contacts is named after their body."""
    entry, leg = motion.contact_entries[contact], legs.get(number, 0)
    return ContactView(
        entry.name,
        column=f"{entry.name.replace(' ', '_')}_",
        is_stop=entry.is_stop,
        unit=entry.unit,
        level=_find_level(motion, contact) if entry.is_stop else None,
        leg=entry.body if list(legs.values()).count(leg) > 1 else entry.name,
        leg_number=leg,
        slides=entry.slides,
    )


def _find_level(motion: PlanarMotion, contact: int) -> tuple[str, float] | None:
    """Return the coordinate that a stop limits and its value there, if their sum or difference is constant."""
    gap = np.concatenate([segment.kinematics.gap[contact] for segment in motion.segments])
    q = motion.channel("q")
    for name, unit, row in zip(motion.coordinates, motion.units, q, strict=True):
        if unit != motion.contact_entries[contact].unit or (np.ptp(row) < LEVEL_TOLERANCE < np.ptp(gap)):
            continue
        for sign in (1.0, -1.0):
            if np.ptp(gap - sign * row) < LEVEL_TOLERANCE:
                return name, float(row[0] - sign * gap[0])
    return None


def _planar_phase(motion: PlanarMotion, segment: PlanarSegment, kept: list[int]) -> PhaseView:
    kinematics = segment.kinematics
    rims = kinematics.rims[:, kept]
    is_round = bool(np.any(kinematics.rims[2] > 0))
    modes = tuple(mode for _, mode in segment.state.modes)
    return PhaseView(
        step=0,
        modes=tuple(modes[i] for i in kept),
        **{name: getattr(segment, name) for name in ("time", "q", "v", "torque", "work", "points")},
        power=None,
        forces=segment.force[kept],
        slides=kinematics.slide[kept],
        slip_speeds=kinematics.slip_speed[kept],
        gaps=kinematics.gap[kept],
        friction_works=segment.friction_work[kept],
        **{name: getattr(segment, name) for name in ("damping_work", "kinetic", "potential", "elastic")},
        places=np.stack([rims[0], rims[1] - rims[2]]),
        rims=rims if is_round else None,
    )


def _planar_event(event: PlanarEvent, kept: list[int]) -> EventView:
    after = tuple(mode for _, mode in (event.outcome or event.after).modes)
    return EventView(
        step=0,
        time=event.time,
        label=" & ".join(event.names),
        is_impact=event.is_impact,
        impulses=event.impulse[kept],
        modes=tuple(after[i] for i in kept),
        actuator_impulses=tuple(replace(stage, reaction=stage.reaction[kept]) for stage in event.actuator_impulses),
    )


def _planar_tokens(
    segments: tuple[PhaseView, ...], ends: list[PlanarEvent | None], names: tuple[str, ...]
) -> tuple[Token, ...]:
    """Return the phases of a sequence and the events that end them."""
    tokens: list[Token] = []
    for phase, (segment, event) in enumerate(zip(segments, ends, strict=True)):
        tokens.append(Token(name_modes(names, segment.modes), segment.mode, phase))
        if event is not None:
            tokens.append(Token("|" if event.is_impact else ">"))
    return tuple(tokens)


def _foot_points(segments: tuple[PhaseView, ...], feet: list[int], count: int) -> dict[int, int]:
    """Return the drawn point of each foot: the one nearest to its place, or to the centre of its rim."""
    points: dict[int, int] = {}
    for foot in feet if segments and count else ():
        part = segments[0]
        place = part.places[:, foot] if part.rims is None else part.rims[:2, foot]
        distances = np.linalg.norm(part.points - place[:, None], axis=0).max(axis=1)
        points[foot] = int(np.argmin(distances))
    return points
