"""The hybrid automaton of a planar robot: smooth phases in one contact state, and the events between them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.integrate import DOP853

from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import Determinacy
from gaitopt.model.planar.phase_system import GuardKind
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.event_location import spans_of
from gaitopt.simulation.planar.contact_resolution import ContactResolution
from gaitopt.simulation.planar.guard_watch import ZERO, GuardWatch, LocatedGuard
from gaitopt.simulation.planar.planar_phase import PlanarPhase
from gaitopt.status import Stop

DRIFT = 1e-11
"""Violation of the constraints at which a state is projected and the integration restarted."""

RELATIVE, ABSOLUTE = 1e-12, 1e-14
"""Tolerances of the integration."""

SPANS = 4
"""Parts of a step of the integrator at whose ends the guards are evaluated."""

MAX_ROUNDS = 5
"""Largest number of times the modes of one instant are chosen again because a stop is released."""


@dataclass(frozen=True, eq=False)
class PlanarState:
    """State of a planar robot between events.

    Attributes
    ----------
    time : float [s]
    q, v : (n_q,) arrays
    contacts : ContactState
    extended : tuple of bool
        Whether each switched spring is extended.
    """

    time: float
    q: Array
    v: Array
    contacts: ContactState
    extended: tuple[bool, ...] = ()

    @property
    def y(self) -> Array:
        """Coordinates and rates, shape (2 n_q,)."""
        return np.concatenate([self.q, self.v])


class PlanarArc(NamedTuple):
    """A smooth phase: samples, and the guard that ended it.

    Attributes
    ----------
    start : PlanarState
    time : (K,) array [s]
    states : (n_y, K) array
        (q, v, works since the start).
    ended_by : GuardKind or None
        None at the time limit.
    failed : bool
        Whether the integrator could not continue.
    """

    start: PlanarState
    time: Array
    states: Array
    ended_by: GuardKind | None
    failed: bool = False


class PlanarAutomaton:
    """A planar robot with given parameters under a torque.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        All parameters by name.
    torque : Function, optional
        (t, q, v) -> u; by default zero.
    """

    def __init__(self, robot: PlanarRobot, values: Mapping[str, float], torque: ca.Function | None = None) -> None:
        self.robot, self.values = robot, dict(values)
        self.torque = torque or _zero_torque(robot)
        _check_torque(robot, self.torque)
        self._phases: dict[tuple[ContactState, tuple[bool, ...]], PlanarPhase] = {}
        self.resolution = ContactResolution(robot, robot.vector(values))
        self.weight = float(robot.mass(robot.vector(values))) * values["gravity"]

    def p(self, extended: tuple[bool, ...]) -> Array:
        """Return the vector of parameters and switches."""
        return self.robot.vector(self.values, extended)

    def phase(self, state: PlanarState) -> PlanarPhase:
        """Return the equations of the contact state of a state."""
        key = state.contacts, state.extended
        if key not in self._phases:
            self._phases[key] = PlanarPhase(self.robot, state.contacts, self.p(state.extended), self.torque)
        return self._phases[key]

    def flow(self, state: PlanarState, until: float) -> PlanarArc:
        """Integrate a contact state until a guard falls through zero or the time limit."""
        phase = self.phase(state)
        anchors = phase.anchors(state.y)
        y = np.concatenate([phase.project(state.y, anchors), np.zeros(phase.n_works)])
        watch = GuardWatch(phase, self.weight, state.time, y)
        times, states = [state.time], [y]
        while times[-1] < until:
            integrator = DOP853(phase.rates, times[-1], states[-1], until, rtol=RELATIVE, atol=ABSOLUTE)
            for event in self._follow(integrator, watch, times, states):
                if event is not None:
                    states[-1] = phase.project(states[-1], anchors)
                    return PlanarArc(state, np.array(times), np.array(states).T, event.kind)
                if phase.drift(states[-1], anchors) > DRIFT:
                    break
            states[-1] = phase.project(states[-1], anchors)
            if integrator.status == "failed":
                return PlanarArc(state, np.array(times), np.array(states).T, None, failed=True)
        return PlanarArc(state, np.array(times), np.array(states).T, None)

    def _follow(
        self, integrator: DOP853, watch: GuardWatch, times: list[float], states: list[Array]
    ) -> Iterator[LocatedGuard | None]:
        """Integrate step by step; yield the first event, or None after a step without an event."""
        while integrator.status == "running":
            integrator.step()
            if integrator.status == "failed":
                return
            dense, event = integrator.dense_output(), None
            for span in spans_of(dense, SPANS):
                event = watch.first(dense, span)
                at = span[1] if event is None else event.time
                if at > times[-1]:
                    times.append(at)
                    states.append(dense(at))
                if event is not None:
                    break
            yield event

    def begin(
        self, q: Array, v: Array, *, latched: tuple[str, ...] | None = None, extended: tuple[bool, ...] | None = None
    ) -> PlanarState | Stop:
        """Return the state at the beginning of a motion, with its contact modes, or the reason why it has none.

        Contacts without gap and normal speed are closed.  By default a stop that can be latched is latched if it is
        closed and the contact that releases it is closed (released by its opening) or open (by its closing).
        """
        robot = self.robot
        parts = self.resolution.kinematics(q, v)
        touching = np.abs(parts.gap) <= ZERO
        closed = [i for i in range(len(robot.contacts)) if touching[i] and abs(parts.normal_speed[i]) <= ZERO]
        if latched is None:
            names = {i for i in closed if robot.contacts[i].latched and _is_kept(robot, i, closed)}
        else:
            names = {robot.contact_index(name) for name in latched}
        modes = [
            Mode.LATCHED if i in names else Mode.CLOSED if i in closed else Mode.FREE for i in range(touching.size)
        ]
        state = PlanarState(
            0.0,
            np.array(q, dtype=float),
            np.array(v, dtype=float),
            self.state_of(modes),
            extended or (False,) * len(robot.switches),
        )
        return self.choose(state, closed, frozenset(names), {})

    def state_of(self, modes: list[Mode]) -> ContactState:
        """Return the contact state with the mode of each contact in order."""
        return ContactState(tuple(zip(self.robot.contact_names, modes, strict=True)))

    def choose(
        self, state: PlanarState, closed: list[int], latched: frozenset[int], ended: Mapping[str, Mode]
    ) -> PlanarState | Stop:
        """Return a state with the modes of its closed contacts, or the reason why they are not determined."""
        u = self.phase(state).torque(state.time, state.y)
        choice = self.resolution.modes(state.q, state.v, u, closed, latched, ended)
        if choice.status is not Determinacy.UNIQUE:
            return Stop.AMBIGUOUS if choice.status is Determinacy.AMBIGUOUS else Stop.INCONSISTENT
        modes = [choice.chosen.get(name, Mode.FREE) for name in self.robot.contact_names]
        return replace(state, contacts=self.state_of(modes))

    def resolve_event(self, arc: PlanarArc) -> tuple[PlanarState, PlanarEvent] | Stop:
        """Return the state after the event that ended an arc, and the event, or the reason of a stop."""
        robot, before = self.robot, arc.start
        y, kind = arc.states[:, -1], arc.ended_by
        if kind is None:
            raise ValueError("an arc that ended at the time limit has no event")
        n = robot.n_q
        state = replace(before, time=float(arc.time[-1]), q=y[:n].copy(), v=y[n : 2 * n].copy())
        modes = [mode for _, mode in before.contacts.modes]
        closed = [i for i, mode in enumerate(modes) if mode is not Mode.FREE]
        closing = self.resolution.closing(state.q, state.v, set(range(len(modes))) - set(closed), ZERO)
        if kind.name == "closes" and kind.index not in closing:
            closing.append(kind.index)
        if any(robot.contacts[i].falls for i in closing):
            return Stop.FELL
        ended = self._ended_modes(kind, modes)
        extended = tuple(on or (kind.name, kind.index) == ("extends", k) for k, on in enumerate(before.extended))
        latched = {i for i in closed if modes[i] is Mode.LATCHED} | {i for i in closing if robot.contacts[i].latched}
        latched -= _released(robot, set(closing), opening=False)
        impulse, lost, touching = np.zeros((len(modes), 2)), 0.0, sorted({*closed, *closing})
        if closing:
            outcome = self.resolution.impact(state.q, state.v, touching, frozenset(latched))
            if outcome.status is not Determinacy.UNIQUE:
                return Stop.AMBIGUOUS if outcome.status is Determinacy.AMBIGUOUS else Stop.INCONSISTENT
            state, lost = replace(state, v=outcome.velocity_plus), outcome.energy_lost
            impulse = np.array([outcome.impulse.get(name, (0.0, 0.0)) for name in robot.contact_names])
            touching = [i for i in touching if outcome.modes[robot.contact_names[i]] is not Mode.FREE]
        settled = self._settle(replace(state, extended=extended), touching, latched, ended, set(closed) | set(closing))
        if isinstance(settled, Stop):
            return settled
        after = settled
        names = self._names(before, after, closing)
        event = PlanarEvent(
            time=state.time,
            names=names,
            before=before.contacts,
            after=after.contacts,
            q=state.q,
            v_minus=y[n : 2 * n].copy(),
            v_plus=after.v,
            impulse=impulse,
            energy_lost=lost,
            switch_work=self._elastic(after, after.extended) - self._elastic(after, before.extended),
        )
        return after, event

    def _settle(
        self,
        state: PlanarState,
        touching: list[int],
        latched: set[int],
        ended: Mapping[str, Mode],
        before: set[int],
    ) -> PlanarState | Stop:
        """Choose the modes until no opening contact releases a stop or a spring any more."""
        robot = self.robot
        for _ in range(MAX_ROUNDS):
            opened = before - set(touching)
            latched -= _released(robot, opened, opening=True)
            off = {robot.contact_names[i] for i in opened}
            extended = tuple(on and name not in off for on, name in zip(state.extended, robot.switches, strict=True))
            chosen = self.choose(replace(state, extended=extended), touching, frozenset(latched), ended)
            if isinstance(chosen, Stop):
                return chosen
            closed = [i for i, (_, mode) in enumerate(chosen.contacts.modes) if mode is not Mode.FREE]
            if closed == touching:
                return chosen
            touching = closed
        return Stop.TOO_MANY_EVENTS

    def _ended_modes(self, kind: GuardKind, modes: list[Mode]) -> dict[str, Mode]:
        """Return the modes that end at a smooth event, by the names of the contacts."""
        if kind.name not in ("opens", "rests", "slips+", "slips-"):
            return {}
        contacts, body = self.robot.contacts, self.robot.contacts[kind.index].body
        members = [kind.index]
        if kind.name != "opens":
            members = [i for i, contact in enumerate(contacts) if contact.slides and contact.body == body]
        return {contacts[i].name: modes[i] for i in members if modes[i] is not Mode.FREE}

    def _names(self, before: PlanarState, after: PlanarState, closing: list[int]) -> tuple[str, ...]:
        """Return the names of everything that changes."""
        names = [f"{self.robot.contact_names[i]} closes" for i in closing]
        changes = zip(before.contacts.modes, after.contacts.modes, strict=True)
        for i, ((name, old), (_, new)) in enumerate(changes):
            if new is Mode.FREE and (old is not Mode.FREE or i in closing):
                names.append(f"{name} opens")
            elif old is Mode.LATCHED and new is not Mode.LATCHED:
                names.append(f"{name} released")
            elif old is not Mode.FREE and new is not old:
                names.append(f"{name} {new.value}")
        switches = zip(self.robot.switches, before.extended, after.extended, strict=True)
        names += [f"{name} extends" for name, old, new in switches if new and not old]
        return tuple(names)

    def _elastic(self, state: PlanarState, extended: tuple[bool, ...]) -> float:
        return float(self.robot.force_powers(state.q, state.v, self.p(extended))[0])


def _released(robot: PlanarRobot, contacts: set[int], *, opening: bool) -> set[int]:
    """Return the stops that the opening or the closing of contacts releases."""
    events = {(robot.contact_names[i], opening) for i in contacts}
    return {i for i, contact in enumerate(robot.contacts) if contact.released_by in events}


def _is_kept(robot: PlanarRobot, stop: int, closed: list[int]) -> bool:
    """Return whether a closed stop is latched at the beginning of a motion."""
    release = robot.contacts[stop].released_by
    if release is None:
        return True
    name, opening = release
    return (robot.contact_index(name) in closed) is opening


def _zero_torque(robot: PlanarRobot) -> ca.Function:
    symbols = [ca.SX.sym("t"), ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)]
    return ca.Function("torque", symbols, [ca.SX.zeros(robot.n_u)])


def _check_torque(robot: PlanarRobot, torque: ca.Function) -> None:
    sizes = [torque.size1_in(i) for i in range(torque.n_in())]
    if sizes != [1, robot.n_q, robot.n_q] or torque.size1_out(0) != robot.n_u:
        raise InputError(
            f"The torque of {robot.name!r} must be a Function (t, q, v) -> u with {robot.n_q} coordinates and "
            f"{robot.n_u} actuators, got {torque}."
        )
