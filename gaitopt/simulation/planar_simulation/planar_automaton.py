"""The hybrid automaton of a planar robot: smooth phases in one contact state, and the events between them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import Footing, GuardKind
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.terrain import Terrain
from gaitopt.motion.motion import Array
from gaitopt.simulation.event_location import spans_of
from gaitopt.simulation.planar_simulation.event_resolution import EventResolution, name_jam
from gaitopt.simulation.planar_simulation.guard_watch import ZERO, GuardWatch, LocatedGuard
from gaitopt.simulation.planar_simulation.law_piece_watch import LawPieceWatch
from gaitopt.simulation.planar_simulation.phase_torque import LawState, TorqueSource
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine, StepIntegrator
from gaitopt.simulation.planar_simulation.planar_phase import RELATIVE, PlanarPhase
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.simulation.planar_simulation.planar_torque import make_torque
from gaitopt.status import Stop

MOST_PHASES = 50
"""Number of contact states whose equations are stored; those of a law differ from step to step if it latches values."""

DRIFT = 1e-11
"""Violation of the constraints, relative to the state, at which a state is projected and the integration restarted."""

SHORT_STEP, MAX_SHORT_STEPS = 1e-10, 30
"""Step of the integrator [s] that is short, and the number of short ones in a row after which the forces count as
unbounded: they grow beyond all limits at the end of well-posed sliding."""

PhaseKey = tuple[ContactState, tuple[bool, ...], LawState | None, tuple[int | None, ...]]
"""Everything on which the equations of a phase depend."""


def accept_step() -> None:
    """Accept a step of an integration."""


class PlanarAutomaton:
    """A planar robot with given parameters under a torque.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        All parameters by name.
    torque : Function, PlanarLaw or TorqueSource, optional
        (t, q, v) -> u, a law, or a source of torques with internal state; by default zero.
    terrain : Terrain, optional
        By default a plane.
    tolerance : float
        Relative tolerance of the integration.
    samples : int, optional
        Largest number of samples of a phase; a phase with more samples counts as failed.
    short_slip : float
        Duration [s] below which the slip of a foot before its lift-off is omitted.
    engine : PlanarEngine
        By default the reference engine.

    Attributes
    ----------
    check : callable
        Called at each step of an integration, which it ends by an error, such as after a Ctrl-C.

    Raises
    ------
    InputError
        If the torque has other inputs or outputs, or the law belongs to another robot.
    """

    def __init__(
        self,
        robot: PlanarRobot,
        values: Mapping[str, float],
        torque: ca.Function | PlanarLaw | TorqueSource | None = None,
        terrain: Terrain | None = None,
        *,
        tolerance: float = RELATIVE,
        samples: int | None = None,
        short_slip: float = 0.0,
        engine: PlanarEngine = REFERENCE,
    ) -> None:
        self.engine, self.check = engine, accept_step
        self.robot, self.values, self.terrain = robot, dict(values), terrain
        self.samples, self._tolerance, self._short_slip = samples, tolerance, short_slip
        self.torque = make_torque(robot, torque)
        self._phases: dict[PhaseKey, PlanarPhase] = {}
        self.events = EventResolution(robot, values, self.torque, terrain)
        self.weight = float(robot.mass(robot.vector(values))) * values["gravity"]

    def p(self, extended: tuple[bool, ...]) -> Array:
        """Return the vector of parameters and switches."""
        return self.robot.vector(self.values, extended)

    def phase(self, state: PlanarState) -> PlanarPhase:
        """Return the equations of the contact state of a state."""
        key = state.contacts, state.extended, state.memory, state.pieces
        if key not in self._phases:
            if len(self._phases) == MOST_PHASES:
                del self._phases[next(iter(self._phases))]
            torque = self.torque.phase_torque(state.memory)
            footing = None if self.terrain is None else Footing(self.terrain, state.pieces)
            self._phases[key] = PlanarPhase(self.robot, state.contacts, self.p(state.extended), torque, footing)
        return self._phases[key]

    def begin(self, q: Array, v: Array, *, latched: tuple[str, ...] | None = None) -> PlanarState | Stop:
        """Return the state at the beginning of a motion, with its contact modes, or the reason why it has none.

        Contacts without gap and normal speed are closed, gaps below 1e-9 become zero, and no spring is extended.  By
        default a stop that can be latched is latched if it is closed and the contact that releases it is closed (if
        released by its opening) or open (if released by its closing).

        Raises
        ------
        InputError
            If a contact starts below the ground or beyond its limit.
        """
        robot, extended = self.robot, (False,) * len(self.robot.switches)
        contacts = self.events.contacts(extended)
        q, v = np.array(q, dtype=float), np.array(v, dtype=float)
        _check_gaps(robot, contacts.kinematics(q, v).gap)
        q = contacts.close_gaps(q, v, ZERO)
        parts = contacts.kinematics(q, v)
        closed = np.flatnonzero((np.abs(parts.gap) <= ZERO) & (np.abs(parts.normal_speed) <= ZERO)).tolist()
        if any(robot.contacts[i].falls for i in closed):
            return Stop.FELL
        if latched is None:
            fixed = frozenset(i for i in closed if robot.contacts[i].latched and _is_kept(robot, i, closed))
        else:
            fixed = frozenset(robot.contact_index(name) for name in latched)
        free = ContactState(tuple((name, Mode.FREE) for name in robot.contact_names))
        state = PlanarState(0.0, q, v, free, extended, self.torque.start(0.0, q, v))
        return self.events.choose(state, sorted({*closed, *fixed}), fixed, {})

    def well_posedness(self, state: PlanarState) -> Callable[[Array], bool] | None:
        """Return the test of whether the forces of a contact state are determined; None if no contact slips."""
        if not any(mode.slips for mode in state.modes):
            return None
        contacts, modes, n = (
            self.events.contacts(state.extended, state.pieces),
            dict(state.contacts.modes),
            self.robot.n_q,
        )
        return lambda y: contacts.is_well_posed(y[:n], y[n : 2 * n], state.closed, modes)

    def flow(self, state: PlanarState, until: float) -> PlanarArc:
        """Integrate a contact state until a guard falls through zero or the time limit."""
        arc = self._integrate(state, until)
        self.phase(state).source.hold_piece(None)
        return arc

    def name_failure(self, arc: PlanarArc) -> Stop:
        """Return the reason why the integration of a phase failed."""
        if self._exceeds(arc.time.size):
            return Stop.TOO_MANY_EVENTS
        return name_jam(arc.start) if any(mode.slips for mode in arc.start.modes) else Stop.SINGULAR

    def _exceeds(self, samples: int) -> bool:
        """Return whether a phase has more samples than are allowed."""
        return self.samples is not None and samples > self.samples

    def restart(self, state: PlanarState) -> PlanarState:
        """Return a state at the beginning of a period, with the law's memory of it."""
        return replace(state, memory=self.torque.start(state.time, state.q, state.v))

    def _integrate(self, state: PlanarState, until: float) -> PlanarArc:
        """Integrate a contact state, with a restart at the corners of the torque and wherever the constraints drift."""
        phase = self.phase(state)
        anchors = phase.anchors(state.y)
        y = np.concatenate([phase.project(state.y, anchors), np.zeros(phase.n_works)])
        watch = GuardWatch(phase, self.weight, state.time, y, self.well_posedness(state), self._short_slip)
        times, states, short, pieces = [state.time], [y], 0, LawPieceWatch(phase, y)
        while times[-1] < until:
            pieces.hold(times[-1], len(times) - 1)
            corner = min(until, phase.source.next_corner(times[-1]), pieces.exit)
            phase.source.hold_piece((times[-1], corner))
            integrator = self.engine.begin(phase, times[-1], states[-1], corner, self._tolerance)
            for event in self._follow(phase, integrator, (watch, pieces), (times, states)):
                self.check()
                if event is not None:
                    states[-1] = phase.project(states[-1], anchors)
                    return _make_arc(state, times, states, pieces, ended_by=event.kind)
                if self._exceeds(len(times)):
                    return _make_arc(state, times, states, pieces, failed=True)
                short = short + 1 if integrator.t - integrator.t_old < SHORT_STEP else 0
                size = 1 + np.max(np.abs(states[-1][: 2 * phase.n_q]))
                if short > MAX_SHORT_STEPS or phase.drift(states[-1], anchors) > DRIFT * size:
                    break
            states[-1] = phase.project(states[-1], anchors)
            if integrator.status == "failed" or short > MAX_SHORT_STEPS:
                return _make_arc(state, times, states, pieces, failed=True)
        return _make_arc(state, times, states, pieces)

    def _follow(
        self,
        phase: PlanarPhase,
        integrator: StepIntegrator,
        watches: tuple[GuardWatch, LawPieceWatch],
        samples: tuple[list[float], list[Array]],
    ) -> Iterator[LocatedGuard | None]:
        """Integrate step by step; yield the first event, or None after a step without an event.

        A step in which the law's phase variable leaves its piece is discarded, and the integration ends before it.
        """
        (times, states), (watch, pieces) = samples, watches
        while integrator.status == "running":
            integrator.step()
            if integrator.status == "failed":
                return
            dense, event = integrator.dense_output(), None
            spans = spans_of(dense, self.engine.spans)
            instants = np.array([(sum(span) / 2, span[1]) for span in spans]).ravel()
            sampled = dense.at_times(instants)
            if pieces.leaves(dense, instants, sampled):
                return
            guards = self.engine.guards(phase, integrator, instants, sampled)
            for span, last, *values in zip(spans, sampled[1::2], guards[::2], guards[1::2], strict=True):
                event = watch.first(dense, span, (values[0], values[1]))
                at = span[1] if event is None else event.time
                if at > times[-1]:
                    times.append(at)
                    states.append(last if event is None else dense(at))
                if event is not None:
                    if at > dense.t_old:
                        refined, y = watch.refine(event, self.engine.locate(phase, integrator, at))
                        if np.all(np.isfinite(y)) and refined > times[max(len(times) - 2, 0)]:
                            times[-1], states[-1] = refined, y
                    break
            yield event


def _make_arc(
    state: PlanarState,
    times: list[float],
    states: list[Array],
    pieces: LawPieceWatch,
    *,
    ended_by: GuardKind | None = None,
    failed: bool = False,
) -> PlanarArc:
    changes = tuple(pieces.changes)
    return PlanarArc(state, np.array(times), np.array(states).T, ended_by, failed=failed, law_pieces=changes)


def _check_gaps(robot: PlanarRobot, gaps: Array) -> None:
    """Raise InputError if a contact starts below the ground or beyond its limit.

    A foot that has to be armed may swing below the ground, but not all feet at a time.
    """
    for contact, gap in zip(robot.contacts, gaps.tolist(), strict=True):
        if gap < -ZERO and not contact.conditional:
            place = "below the ground" if contact.kind != "stop" else "beyond its limit"
            raise InputError(f"Contact {contact.name!r} starts {place}: its gap must be at least 0, got {gap:.3g}.")
    feet = {c.name: gap for c, gap in zip(robot.contacts, gaps.tolist(), strict=True) if not c.is_stop and not c.falls}
    if feet and max(feet.values()) < -ZERO:
        listed = ", ".join(f"{name!r}: {gap:.3g}" for name, gap in feet.items())
        raise InputError(f"All feet start below the ground: at least one gap must be at least 0, got {listed}.")


def _is_kept(robot: PlanarRobot, stop: int, closed: list[int]) -> bool:
    """Return whether a closed stop is latched at the beginning of a motion."""
    release = robot.contacts[stop].released_by
    if release is None:
        return True
    name, opening = release
    return (robot.contact_index(name) in closed) is opening
