"""Resolution of the events of a planar robot: impact, released stops, switched springs, and the modes that follow."""

import functools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import Determinacy
from gaitopt.model.planar.phase_system import Footing, GuardKind
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.terrain import Terrain
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.planar_simulation.contact_resolution import ContactResolution
from gaitopt.simulation.planar_simulation.footholds import cross_piece, find_pieces, hits_step, is_uneven
from gaitopt.simulation.planar_simulation.guard_watch import JAMS, OPENING_GAP, ZERO
from gaitopt.simulation.planar_simulation.impact_passage import UNDETERMINED, ImpactPassage, pass_impact
from gaitopt.simulation.planar_simulation.phase_torque import TorqueSource
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.status import Stop

MAX_ROUNDS = 5
"""Largest number of times the modes of one instant are chosen again because a stop is released."""

APPROACH = 1e-6
"""Acceleration [m/s^2] towards the ground of a contact without force that is due to rounding."""


class EventResolution:
    """Continues the motion of a planar robot after an event.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        All parameters by name.
    torque : TorqueSource
    terrain : Terrain, optional
        By default a plane.
    """

    def __init__(
        self,
        robot: PlanarRobot,
        values: Mapping[str, float],
        torque: TorqueSource,
        terrain: Terrain | None = None,
    ) -> None:
        self.robot, self._values, self._source, self.terrain = robot, dict(values), torque, terrain
        self._resolutions: dict[tuple[tuple[bool, ...], tuple[int | None, ...]], ContactResolution] = {}

    def contacts(self, extended: tuple[bool, ...], pieces: tuple[int | None, ...] = ()) -> ContactResolution:
        """Return modes and impacts for some extended springs, on pieces of the terrain under the closed contacts."""
        key = extended, pieces
        if key not in self._resolutions:
            p, terrain = self.robot.vector(self._values, extended), self.terrain
            footing = None if terrain is None else Footing(terrain, pieces or (None,) * len(self.robot.contacts))
            self._resolutions[key] = ContactResolution(self.robot, p, footing)
        return self._resolutions[key]

    def _contacts_of(self, state: PlanarState) -> ContactResolution:
        return self.contacts(state.extended, state.pieces)

    def _p(self, state: PlanarState) -> Array:
        return self.robot.vector(self._values, state.extended)

    def _place(self, state: PlanarState, closed: list[int]) -> PlanarState:
        """Return a state with the pieces of the terrain under closed contacts."""
        if self.terrain is None:
            return state
        places, levels = self.contacts(state.extended).locate(state.q)
        return replace(state, pieces=find_pieces(self.terrain, state, closed, places, levels))

    def choose(
        self, state: PlanarState, closed: list[int], latched: frozenset[int], ended: Mapping[str, Mode]
    ) -> PlanarState | Stop:
        """Return a state with the modes of its closed contacts, or the reason why they are not determined."""
        state = self._place(state, closed)
        if self._is_uneven(state):
            return Stop.UNEVEN
        choice = self._contacts_of(state).modes(state.q, state.v, self._torque(state), closed, latched, ended)
        if choice.status is not Determinacy.UNIQUE:
            return UNDETERMINED[choice.status]
        chosen = replace(state, contacts=self._state_of(choice.chosen))
        return self._place(chosen, chosen.closed)

    def resolve(self, arc: PlanarArc, impulses: EventImpulses | None = None) -> tuple[PlanarState, PlanarEvent] | Stop:
        """Return the state after the event that ended an arc, and the event, or the reason of a stop.

        Parameters
        ----------
        arc : PlanarArc
        impulses : EventImpulses, optional
            Impulses of the actuators if the event is an impact; by default those of the torque source.
        """
        robot, before, kind, n = self.robot, arc.start, arc.ended_by, self.robot.n_q
        if kind is None:
            raise ValueError("an arc that ended at the time limit has no event")
        if kind == JAMS:
            return name_jam(before)
        q, v = arc.states[:n, -1].copy(), arc.states[n : 2 * n, -1].copy()
        state = replace(before, time=float(arc.time[-1]), q=q, v=v)
        closing = self._closing(state, kind)
        if any(robot.contacts[i].falls for i in closing):
            return Stop.FELL
        if self._stumbles(state, closing):
            return Stop.STUMBLED
        extended = tuple(on or kind == ("extends", k) for k, on in enumerate(before.extended))
        latched = before.latched | {i for i in closing if robot.contacts[i].latched}
        latched -= _stops_freed_by(robot, set(closing), opening=False)
        touching = sorted({*before.closed, *closing})
        passage: ImpactPassage | None = None
        if closing:
            state = self._place(state, touching)
            if self._is_uneven(state):
                return Stop.UNEVEN
            names = [robot.contact_names[i] for i in closing]
            acting = impulses or self._source.impulses(state.memory, names)
            passed = pass_impact(self._contacts_of(state), self._p(state), state, (touching, latched), acting)
            if isinstance(passed, Stop):
                return self._name_stop(passed)
            touching, passage = passed.closed, passed
            memory = self._source.pass_impact(state.memory, names, state.time, q, passage.v_plus)
            state = replace(state, v=passage.v_plus, memory=memory)
        was_closed = {*before.closed, *closing}
        if kind.name == "opens" and not closing and self._leaves(state, kind.number, latched):
            touching.remove(kind.number)
        if self.terrain is not None and kind.name in ("crosses-", "crosses+"):
            crossed = cross_piece(self.terrain, state.pieces, kind)
            if crossed is None or self._is_rough(crossed, kind.number):
                return Stop.STUMBLED
            state = replace(state, pieces=crossed)
            touching = [i for i in touching if i != kind.number or crossed[i] is not None]
        after = self._settle(
            replace(state, extended=extended), touching, latched, self._find_ending_modes(kind, before), was_closed
        )
        if isinstance(after, Stop):
            return self._name_stop(after)
        unchanged = after.contacts == before.contacts and after.pieces == before.pieces
        if not closing and unchanged and after.extended == before.extended:
            return self._name_stop(Stop.INCONSISTENT)  # the present modes end, and no others satisfy the friction law
        return self._pass_event(before, after, v, closing, passage)

    def _pass_event(
        self,
        before: PlanarState,
        after: PlanarState,
        v_minus: Array,
        closing: list[int],
        passage: ImpactPassage | None,
    ) -> tuple[PlanarState, PlanarEvent] | Stop:
        """Return the state with the law's memory after an event, and the event; another torque may change the modes."""
        memory = self._source.pass_event(after.memory, self._names(before, after, closing))
        if memory != after.memory:
            chosen = self.choose(replace(after, memory=memory), after.closed, after.latched, {})
            if isinstance(chosen, Stop):
                return self._name_stop(chosen)
            after = chosen
        return after, self._event(before, after, v_minus, closing, passage)

    def _name_stop(self, stop: Stop) -> Stop:
        """Return the reason of a stop.

        For any finite coefficient of friction a foot slips before its normal force vanishes, if a tangential force
        remains.  In the limit of infinite friction it slips without normal force, which a foot that never slips cannot.
        """
        return Stop.MUST_SLIP if stop is Stop.INCONSISTENT and np.isinf(self._values["friction"]) else stop

    def _leaves(self, state: PlanarState, contact: int, latched: frozenset[int]) -> bool:
        """Return whether a contact without force leaves: without it, its gap has no acceleration towards the ground.

        The choice among all modes is not determined by rounded forces if the friction cone has shrunk to a point.
        """
        resolution, others = self._contacts_of(state), [i for i in state.closed if i != contact]
        choice = resolution.modes(state.q, state.v, self._torque(state), others, latched - {contact}, {})
        if choice.status is not Determinacy.UNIQUE:
            return False
        parts = resolution.kinematics(state.q, state.v)
        return bool(parts.normal[contact] @ choice.acceleration + parts.normal_bias[contact] >= -APPROACH)

    def _closing(self, state: PlanarState, kind: GuardKind) -> list[int]:
        """Return the contacts that close: at a touchdown, all within its tolerance; at another event, those that touch.

        A contact that touches shortly after an event that is not a touchdown has a separate event.
        """
        free = [i for i, mode in enumerate(state.modes) if mode is Mode.FREE]
        contacts = self._contacts_of(state)
        closing = contacts.closing(state.q, state.v, free, ZERO)
        if kind.name != "closes":
            gaps = contacts.kinematics(state.q, state.v).gap
            return [i for i in closing if gaps[i] <= OPENING_GAP]
        return closing if kind.number in closing else [*closing, kind.number]

    def _is_uneven(self, state: PlanarState) -> bool:
        return self.terrain is not None and is_uneven(self.robot, self.terrain, state.pieces)

    def _is_rough(self, pieces: tuple[int | None, ...], contact: int) -> bool:
        """Return whether a contact is on a piece of infinite friction."""
        number, friction = pieces[contact], self._values["friction"]
        return number is not None and np.isinf(Footing(self.terrain or Terrain(), pieces).friction(contact, friction))

    def _stumbles(self, state: PlanarState, closing: list[int]) -> bool:
        """Return whether a closing contact hits the front of a step."""
        if self.terrain is None or not closing:
            return False
        places, levels = self.contacts(state.extended).locate(state.q)
        return any(hits_step(self.terrain, places[i], levels[i]) for i in closing)

    def _settle(
        self,
        state: PlanarState,
        touching: list[int],
        latched: frozenset[int],
        ended: Mapping[str, Mode],
        was_closed: set[int],
    ) -> PlanarState | Stop:
        """Choose the modes until no opening contact releases a stop or a spring any more."""
        robot = self.robot
        for _ in range(MAX_ROUNDS):
            opened = was_closed - set(touching)
            latched = frozenset(latched - _stops_freed_by(robot, opened, opening=True))
            off = {robot.contact_names[i] for i in opened}
            extended = tuple(on and name not in off for on, name in zip(state.extended, robot.switches, strict=True))
            chosen = self.choose(replace(state, extended=extended), touching, latched, ended)
            if isinstance(chosen, Stop) or chosen.closed == touching:
                return chosen
            touching = chosen.closed
        return Stop.TOO_MANY_EVENTS

    def _find_ending_modes(self, kind: GuardKind, before: PlanarState) -> dict[str, Mode]:
        """Return the modes that end at a smooth event, by the names of the contacts."""
        if kind.name not in ("opens", "rests", "slips+", "slips-"):
            return {}
        contacts, members = self.robot.contacts, [kind.number]
        if kind.name != "opens":
            body = contacts[kind.number].body
            members = [i for i in before.closed if contacts[i].slides and contacts[i].body == body]
        return {contacts[i].name: Mode.CLOSED if kind.name == "opens" else before.modes[i] for i in members}

    def _event(
        self,
        before: PlanarState,
        after: PlanarState,
        v_minus: Array,
        closing: list[int],
        passage: ImpactPassage | None,
    ) -> PlanarEvent:
        """Return the record of an event."""
        names, stages = self.robot.contact_names, () if passage is None else passage.stages
        outcome, lost = None if passage is None else passage.outcome, 0.0
        impulse = {} if outcome is None else outcome.impulse
        if outcome is not None:
            lost = self._kinetic(after, v_minus) - self._kinetic(after, after.v) + sum(one.work for one in stages)
        return PlanarEvent(
            time=after.time,
            names=self._names(before, after, closing),
            before=before.contacts,
            after=after.contacts,
            q=after.q,
            v_minus=v_minus,
            v_plus=after.v,
            impulse=np.array([impulse.get(name, (0.0, 0.0)) for name in names]),
            outcome=None if outcome is None else self._state_of(outcome.modes),
            energy_lost=lost,
            switch_work=self._elastic(after, after.extended) - self._elastic(after, before.extended),
            actuator_impulses=stages,
        )

    def _names(self, before: PlanarState, after: PlanarState, closing: list[int]) -> tuple[str, ...]:
        """Return the names of everything that changes."""
        names = [f"{self.robot.contact_names[i]} closes" for i in closing]
        changes = zip(self.robot.contact_names, before.modes, after.modes, strict=True)
        for i, (name, old, new) in enumerate(changes):
            if old is Mode.LATCHED and new is not Mode.LATCHED:
                names.append(f"{name} released")
            elif new is Mode.FREE and (old is not Mode.FREE or i in closing):
                names.append(f"{name} opens")
            elif old is not Mode.FREE and new is not old:
                names.append(f"{name} {new.value}")
            if None not in (pieces := (_piece_of(before, i), _piece_of(after, i))) and pieces[0] != pieces[1]:
                names.append(f"{name} crosses")
        switches = zip(self.robot.switches, before.extended, after.extended, strict=True)
        return (*names, *(f"{name} extends" for name, old, new in switches if new and not old))

    def _torque(self, state: PlanarState) -> Array:
        return self._source.phase_torque(state.memory).value(state.time, state.q, state.v)

    def _kinetic(self, state: PlanarState, v: Array) -> float:
        return float(self.robot.energy(state.q, v, self.robot.vector(self._values))[0])

    def _state_of(self, modes: Mapping[str, Mode]) -> ContactState:
        """Return the contact state with some modes; other contacts are free."""
        return _make_contact_state(tuple((name, modes.get(name, Mode.FREE)) for name in self.robot.contact_names))

    def _elastic(self, state: PlanarState, extended: tuple[bool, ...]) -> float:
        p = self.robot.vector(self._values, extended)
        return float(self.robot.force_powers(state.q, state.v, p)[0])


@functools.lru_cache(maxsize=1024)
def _make_contact_state(modes: tuple[tuple[str, Mode], ...]) -> ContactState:
    """Return a contact state; its arguments are checked when it is made, which takes longer than a choice of modes."""
    return ContactState(modes)


def _piece_of(state: PlanarState, contact: int) -> int | None:
    return state.pieces[contact] if state.pieces else None


def name_jam(state: PlanarState) -> Stop:
    """Return the name of a state in which the forces of sliding contacts are not determined."""
    return Stop.PAINLEVE if len(state.closed) == 1 else Stop.JAM


def _stops_freed_by(robot: PlanarRobot, contacts: set[int], *, opening: bool) -> set[int]:
    """Return the stops that the opening or the closing of some contacts releases."""
    events = {(robot.contact_names[i], opening) for i in contacts}
    return {i for i, contact in enumerate(robot.contacts) if contact.released_by in events}
