"""A second replay of gaits with several contacts: SciPy's integrator and separate contact equations.

Only the symbolic equations of the robot are shared with the simulator: mass matrix, bias and actuation, gaps and their
Jacobians.  Contact forces, contact modes, event location, impacts and the effect of the planned impulses of actuators
are computed here.  Closed contacts of one body have a common tangential force and slip direction.  Joint stops, latches
and switched springs are not supported.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from gaitopt.errors import GaitoptError
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.motion.stated_changes import find_closing
from gaitopt.study.audit.contact_solver import Contacts, ContactSolver
from gaitopt.study.audit.piecewise_integration import Crossing, SmoothPiece, TorqueTable, integrate_piece
from gaitopt.study.audit.second_replay import INSTANT, NAMES, SecondReplay
from gaitopt.study.audit.swing_watch import EXTREMA, ReplayGuard, ReplayGuardKind, SwingWatch

AT_REST = 1e-9
"""Speeds below this are zero [m/s]."""

FORCE = 1e-9
"""Forces and accelerations above minus this share of the weight, or of gravity, count as not negative."""

IMPULSE = 1e-12
"""Share of all normal impulses below which the magnitude of a negative impulse counts as zero."""

LIGHT = 1e-4
"""Share of the weight below which a foot that reaches the friction cone leaves the ground."""

LATE = 1.02
"""Time at which a replay ends, over the period of the plan."""


def replay_planar_again(gait: PlanarGait) -> SecondReplay:
    """Replay the torques of a gait with several contacts from its first state.

    Parameters
    ----------
    gait : PlanarGait

    Returns
    -------
    SecondReplay

    Raises
    ------
    GaitoptError
        If the robot has joint stops, latches or switched springs.

    Examples
    --------
    >>> replay_planar_again.__name__
    'replay_planar_again'
    """
    robot = gait.robot
    if robot.switches or any(entry.is_stop for entry in robot.contacts):
        raise GaitoptError(
            f"The second replay does not support joint stops and switched springs, which robot {robot.name} has."
        )
    return _Period(gait).run()


class _Period:
    """One period of a robot under the planned torques; the state is (q, v)."""

    def __init__(self, gait: PlanarGait) -> None:
        self.gait, robot, motion = gait, gait.robot, gait.motion
        friction = motion.parameters["friction"]
        static = friction * motion.parameters.get("static_friction_ratio", 1.0)
        self.solver = ContactSolver(robot, robot.vector(motion.parameters), (static, friction))
        self._swings = SwingWatch(self.solver)
        self._n, self._tables = robot.n_q, _tables(gait)
        self._table, self._begin = self._tables.pop(0), 0.0
        self._impulses = [_read_impulses(gait, event) for event in motion.events if event.is_impact]

    def run(self) -> SecondReplay:
        """Return the result of the replay."""
        motion = self.gait.motion
        first, now = motion.segments[0], float(motion.segments[0].time[0])
        state, parts = np.concatenate([first.q[:, 0], first.v[:, 0]]), list[str]()
        contacts = self._settle(self._find_touching(state), now, state)
        for place in range(len(motion.events)):
            if contacts is None:
                return _report_stop(parts, "no contact modes are consistent", now)
            parts.append(self._describe(contacts))
            end = self._flow(contacts, now, state)
            now, state = end.time, end.state
            if end.key is None:
                return _report_stop(parts, "no further event", now)
            landed = end.key.kind is ReplayGuardKind.GAP
            if landed and self.gait.robot.contacts[end.key.place].falls:
                return _report_stop(parts, "the robot falls", now)
            last = place + 1 == len(motion.events)
            self._swings.record(contacts.closed, state)
            below = self._swings.find_touchdown_from_below(end.key.place if landed else None, last=last)
            if below is not None:
                return _report_stop(parts, f"{self.gait.robot.contact_names[below]} touches down from below", now)
            parts.append("|" if landed else ">")
            contacts = self._land(contacts, end, last) if landed else self._change(contacts, end)
        if contacts is None:
            return _report_stop(parts, "the impact has no outcome", now)
        return self._compare(parts, now, state)

    def _find_touching(self, state: Array) -> tuple[int, ...]:
        """Return the contacts that are on the ground and do not leave it."""
        q, v = state[: self._n], state[self._n :]
        gaps, normal = self.solver.gaps(q)[0], self.solver.rows(q, v)[0]
        return tuple(place for place in range(gaps.size) if gaps[place] < AT_REST and normal[place] @ v < AT_REST)

    def _compare(self, parts: list[str], now: float, state: Array) -> SecondReplay:
        planned = self.gait.motion.events[-1]
        errors = np.abs(state - np.concatenate([planned.q, planned.v_plus]))
        return SecondReplay(_join(parts), "", float(np.max(errors)), abs(now - planned.time))

    def _describe(self, contacts: Contacts) -> str:
        """Return the closed contacts and their modes, as in a contact sequence."""
        names = self.gait.robot.contact_names
        modes = [f"{names[c]} {NAMES[contacts.slide(self.solver.bodies[c])]}" for c in sorted(contacts.closed)]
        return ", ".join(modes) or "flight"

    def _flow(self, contacts: Contacts, now: float, state: Array) -> Crossing:
        """Return the event that ends a phase."""
        last = self.gait.motion.segments[0].time[0] + LATE * self.gait.period
        guards = self._guards(contacts)
        checked = tuple(guard for guard in guards if guard.kind not in (ReplayGuardKind.GAP, ReplayGuardKind.REST))
        self._swings.record(contacts.closed, state)

        def rate(t: float, y: Array, middle: float) -> Array:
            acceleration = self.solver.accelerate(contacts, y, self._table.evaluate(t, middle))[0]
            return np.concatenate([y[self._n :], acceleration])

        self._begin = now
        watched = guards | self._swings.list_guards(contacts.closed)
        piece = SmoothPiece(rate, watched, partial(self._accepts, contacts), checked)
        return integrate_piece(piece, state, np.array([now, *self._table.corners(now + INSTANT, last), last]))

    def _accepts(self, contacts: Contacts, guard: ReplayGuard, time: float, state: Array) -> bool:
        if guard.kind in EXTREMA:
            self._swings.record(contacts.closed, state)
            return False
        if guard.kind is ReplayGuardKind.REST:
            return time > self._begin + INSTANT
        if guard.kind is not ReplayGuardKind.GAP:
            return True
        conditional = self.gait.robot.contacts[guard.place].conditional
        armed = not conditional or self._swings.is_armed(guard.place, state)
        return armed and time > self._begin + INSTANT

    def _guards(self, contacts: Contacts) -> dict[ReplayGuard, Any]:
        """Return the guards of a phase: gaps, normal forces, friction cones and slip speeds."""
        guards: dict[ReplayGuard, Any] = {}
        for place in range(len(self.solver.bodies)):
            if place in contacts.closed:
                guards[ReplayGuard(ReplayGuardKind.LIFT_OFF, place)] = partial(self._normal, contacts, place)
            else:
                guards[ReplayGuard(ReplayGuardKind.GAP, place)] = partial(self._gap, place)
        for body, slide in contacts.slides:
            if slide:
                guards[ReplayGuard(ReplayGuardKind.REST, body=body)] = partial(self._slip, contacts, body, slide)
            elif np.isfinite(self.solver.static):
                guards[ReplayGuard(ReplayGuardKind.FORWARD, body=body)] = partial(self._cone, contacts, body, 1)
                guards[ReplayGuard(ReplayGuardKind.BACKWARD, body=body)] = partial(self._cone, contacts, body, -1)
        return guards

    def _gap(self, place: int, t: float, y: Array, middle: float) -> float:
        return float(self.solver.gaps(y[: self._n])[0][place])

    def _normal(self, contacts: Contacts, place: int, t: float, y: Array, middle: float) -> float:
        return float(self.solver.accelerate(contacts, y, self._table.evaluate(t, middle))[1][place])

    def _slip(self, contacts: Contacts, body: str, slide: int, t: float, y: Array, middle: float) -> float:
        return slide * self.solver.slip_speed(body, contacts.closed, y)

    def _cone(self, contacts: Contacts, body: str, sign: int, t: float, y: Array, middle: float) -> float:
        _, normal, tangential = self.solver.accelerate(contacts, y, self._table.evaluate(t, middle))
        return self.solver.static * self._load(contacts, body, normal) + sign * float(tangential[body])

    def _load(self, contacts: Contacts, body: str, normal: Array) -> float:
        return float(sum(normal[place] for place in contacts.closed if self.solver.bodies[place] == body))

    def _change(self, contacts: Contacts, end: Crossing) -> Contacts | None:
        """Return the modes after an event without impact."""
        kind, leaving, body = end.key
        slides = dict(contacts.slides)
        if kind in (ReplayGuardKind.FORWARD, ReplayGuardKind.BACKWARD) and self._is_light(contacts, body, end):
            leaving = next(place for place in contacts.closed if self.solver.bodies[place] == body)
            kind = ReplayGuardKind.LIFT_OFF
        if kind is ReplayGuardKind.LIFT_OFF:
            closed = tuple(place for place in contacts.closed if place != leaving)
            bodies = {self.solver.bodies[place] for place in closed}
            return Contacts(closed, tuple((body, slide) for body, slide in contacts.slides if body in bodies))
        if kind is ReplayGuardKind.REST:
            slides[body] = self._slide_from_rest(contacts, body, end)
        else:
            slides[body] = 1 if kind is ReplayGuardKind.FORWARD else -1
        return replace(contacts, slides=tuple(slides.items()))

    def _is_light(self, contacts: Contacts, body: str, end: Crossing) -> bool:
        """Return whether the normal force of a body vanishes: friction is then not determined, and the body leaves."""
        torque = self._table.evaluate(end.time, end.time - INSTANT)
        normal = self.solver.accelerate(contacts, end.state, torque)[1]
        return self._load(contacts, body, normal) < LIGHT * self.solver.weight

    def _slide_from_rest(self, contacts: Contacts, body: str, end: Crossing) -> int:
        """Return 0 if the force of a body that comes to rest lies in the cone, otherwise its direction of slip."""
        rest = replace(contacts, slides=tuple({**dict(contacts.slides), body: 0}.items()))
        torque = self._table.evaluate(end.time, end.time + INSTANT)
        _, normal, tangential = self.solver.accelerate(rest, end.state, torque)
        inside = abs(tangential[body]) <= self.solver.static * self._load(rest, body, normal)
        return 0 if inside else -int(np.sign(tangential[body]))

    def _land(self, contacts: Contacts, end: Crossing, last: bool) -> Contacts | None:
        """Return the modes after an impact and the impulses of actuators at it; the rates of the state change."""
        gaps, normal = (
            self.solver.gaps(end.state[: self._n])[0],
            self.solver.rows(end.state[: self._n], end.state[self._n :])[0],
        )
        landing = end.key.place
        falls = [c for c in range(gaps.size) if abs(gaps[c]) < AT_REST and normal[c] @ end.state[self._n :] < 0]
        places, impulses = tuple(sorted({*contacts.closed, landing, *falls})), self._take_impulses({landing, *falls})
        closed = contacts.closed
        if impulses[0].any() and self._jump(closed, end.state, impulses[0]) is None:
            return None
        modes = self._jump(places, end.state, np.zeros_like(impulses[0]))
        if modes is not None and impulses[1].any():
            closed = tuple(c for c in places if normal[c] @ end.state[self._n :] < AT_REST)
            modes = self._jump(closed, end.state, impulses[1])
            places = closed
        if modes is None or last:
            return modes
        if self._tables:
            self._table = self._tables.pop(0)
        on_ground = tuple(c for c in places if normal[c] @ end.state[self._n :] < AT_REST)
        return self._settle(on_ground, end.time, end.state)

    def _take_impulses(self, closing: set[int]) -> Array:
        """Return the planned impulses at the next impact, shape (2, n_u); zero if other contacts close."""
        planned, values = self._impulses.pop(0) if self._impulses else (set[int](), np.zeros((2, self.gait.robot.n_u)))
        return values if planned & closing else np.zeros_like(values)

    def _jump(self, places: tuple[int, ...], state: Array, impulse: Array) -> Contacts | None:
        """Return the modes of an instantaneous change of the rates under impulses of actuators, and apply it."""
        for modes in self.solver.list_modes(places):
            v_plus = self._outcome(modes, places, state, impulse)
            if v_plus is not None:
                state[self._n :] = v_plus
                return modes
        return None

    def _outcome(self, modes: Contacts, places: tuple[int, ...], state: Array, impulse: Array) -> Array | None:
        """Return the rates after an impact in some modes, or None if these are not consistent."""
        try:
            v_plus, normal, tangential = self.solver.collide(modes, state, impulse)
        except np.linalg.LinAlgError:
            return None
        after = np.concatenate([state[: self._n], v_plus])
        rows = self.solver.rows(after[: self._n], v_plus)[0]
        least = -IMPULSE * float(np.sum(np.abs(normal)))
        if any(normal[place] < least if place in modes.closed else rows[place] @ v_plus < 0 for place in places):
            return None
        for body, slide in modes.slides:
            load = self._load(modes, body, normal)
            if slide and not slide * self.solver.slip_speed(body, modes.closed, after) > 0:
                return None
            largest = self.solver.sliding * max(load, 0.0) - least if np.isfinite(self.solver.sliding) else np.inf
            if not slide and not abs(tangential[body]) <= largest:
                return None
        return v_plus

    def _settle(self, places: tuple[int, ...], now: float, state: Array) -> Contacts | None:
        """Return consistent modes of contacts that are on the ground with no normal velocity."""
        torque = self._table.evaluate(now, now + INSTANT)
        for modes in self.solver.list_modes(places):
            if self._is_consistent(modes, places, state, torque):
                return modes
        return None

    def _is_consistent(self, modes: Contacts, places: tuple[int, ...], state: Array, torque: Array) -> bool:
        """Return whether forces, accelerations and slip directions agree with some modes."""
        solver, least = self.solver, -FORCE * self.solver.weight
        try:
            acceleration, normal, tangential = solver.accelerate(modes, state, torque)
        except np.linalg.LinAlgError:
            return False
        rows = solver.rows(state[: self._n], state[self._n :])
        for place in places:
            rising = rows[0][place] @ acceleration + rows[2][place]
            if (normal[place] if place in modes.closed else rising) < (least if place in modes.closed else -FORCE):
                return False
        for body, slide in modes.slides:
            speed = solver.slip_speed(body, modes.closed, state)
            if abs(speed) > AT_REST:
                if slide != np.sign(speed):
                    return False
                continue
            place = next(place for place in modes.closed if solver.bodies[place] == body)
            if slide and not slide * (rows[1][place] @ acceleration + rows[3][place]) > 0:
                return False
            if not slide and abs(tangential[body]) > solver.static * self._load(modes, body, normal):
                return False
        return True


def _tables(gait: PlanarGait) -> list[TorqueTable]:
    """Return the torques of the plan between its impacts."""
    groups, segments = list[TorqueTable](), []
    for segment, event in zip(gait.motion.segments, gait.motion.events, strict=True):
        segments.append(segment)
        if event.is_impact:
            groups.append(_table(segments))
            segments = []
    return [*groups, *([_table(segments)] if segments else [])]


def _read_impulses(gait: PlanarGait, event: PlanarEvent) -> tuple[set[int], Array]:
    """Return the contacts that close at an impact, and the impulses of actuators before and after it."""
    names, values = gait.robot.contact_names, np.zeros((2, gait.robot.n_u))
    for stage in event.actuator_impulses:
        values[int(stage.moment == "after")] = stage.impulse
    return {names.index(name) for name in find_closing(event.names)}, values


def _table(segments: list) -> TorqueTable:
    time = np.concatenate([segment.time for segment in segments])
    torque = np.concatenate([segment.torque for segment in segments], axis=1)
    time, kept = np.unique(time, return_index=True)
    return TorqueTable(time, torque[:, kept], continued=True)


def _join(parts: list[str]) -> str:
    return " ".join(parts).removesuffix(" >")


def _report_stop(parts: list[str], reason: str, now: float) -> SecondReplay:
    return SecondReplay(_join(parts), f"{reason} at {now:.6g} s", np.inf, np.inf)
