"""Walks of a robot with several contacts under a law that reads the state with a delay.

As in :mod:`gaitopt.simulation.delay`, a sensor takes readings at equal intervals, and each reading reaches the law
after the delay.  The contact modes are chosen again at each arrival, at which the torque jumps.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.phase_torque import LawState, PhaseTorque, TorqueSlope, TorqueSource
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, follow
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.simulation.planar_simulation.planar_torque import make_torque
from gaitopt.simulation.planar_simulation.planar_walker import (
    LONGEST,
    MOST_EVENTS,
    NO_STEP,
    SAMPLES,
    TOLERANCE,
    PlanarWalkStep,
    exchange_legs,
)
from gaitopt.status import Stop

READINGS = 4
"""Number of readings per delay; the state that the law reads is 1 to 1.25 delays old."""

SIMULTANEOUS = 1e-12
"""Times that differ by less than this are equal [s]."""


class _PlanarReading(NamedTuple):
    """A state (q, v) and its time of arrival; a reading at the section also contains the latched values of the law."""

    arrival: float
    q: Array
    v: Array
    latched: tuple[float, ...] | None


class _ReadSource(TorqueSource):
    """The torque of a law that reads the last reading instead of the state."""

    def __init__(self, inner: TorqueSource) -> None:
        self._inner, self.n_latched = inner, inner.n_latched
        self.q: Array = np.empty(0)
        self.v: Array = np.empty(0)

    def start(self, time: float, q: Array, v: Array) -> LawState | None:
        return self._inner.start(time, q, v)

    def pass_impact(
        self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array
    ) -> LawState | None:
        return self._inner.pass_impact(memory, closing, time, q, v)

    def pass_event(self, memory: LawState | None, names: Iterable[str]) -> LawState | None:
        return self._inner.pass_event(memory, names)

    def impulses(self, memory: LawState | None, closing: Iterable[str]) -> EventImpulses | None:
        return self._inner.impulses(memory, closing)

    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        return _ReadTorque(self._inner.phase_torque(memory), self)


class _ReadTorque(PhaseTorque):
    def __init__(self, inner: PhaseTorque, source: _ReadSource) -> None:
        self._inner, self._source = inner, source
        self.next_corner, self.hold_piece = inner.next_corner, inner.hold_piece  # type: ignore[method-assign]

    def value(self, t: float, q: Array, v: Array) -> Array:
        return self._inner.value(t, self._source.q, self._source.v)

    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        slope = self._inner.slope(t, self._source.q, self._source.v)
        return slope._replace(by_state=np.zeros_like(slope.by_state))


class DelayedPlanarWalker:
    """A walker whose law reads the state with a delay, for one walk; pending readings persist from step to step.

    Parameters
    ----------
    robot : PlanarRobot
    law : PlanarLaw
    parameters : mapping of str to float
        All parameters of robot and ground.
    section : str
    period : float [s]
        As for :class:`gaitopt.simulation.planar_simulation.planar_walker.PlanarWalker`.
    delay : float [s]
    """

    def __init__(
        self,
        robot: PlanarRobot,
        law: PlanarLaw,
        parameters: Mapping[str, float],
        *,
        section: str,
        period: float,
        delay: float,
    ) -> None:
        self._robot, self._section, self._duration, self._delay = robot, section, LONGEST * period, delay
        self._source = _ReadSource(make_torque(robot, law))
        self._automaton = PlanarAutomaton(robot, parameters, self._source, tolerance=TOLERANCE, samples=SAMPLES)
        self._pending = deque[_PlanarReading]()
        self._latched: tuple[float, ...] | None = None
        self._next = 0.0

    def walk_step(self, state: PlanarState) -> PlanarWalkStep:
        """Simulate the next step of the walk; its motion is that after the last arrival of a reading."""
        state, events = self._begin_step(state), 0
        while True:
            state = self._update_reading(state)
            end = min([self._duration, self._next, *[reading.arrival for reading in self._pending]])
            chosen = self._automaton.events.choose(state, state.closed, state.latched, {})
            rollout = follow(
                self._automaton,
                chosen,
                duration=end - state.time,
                until=self._section,
                most_events=MOST_EVENTS - events,
                most_samples=2 * SAMPLES,
            )
            events += len(rollout.motion.events)
            if rollout.end is None or rollout.stop is not Stop.DURATION_DONE:
                return self._end_step(rollout)
            state = rollout.end
            if state.time >= self._duration - SIMULTANEOUS:
                return PlanarWalkStep(rollout, NO_STEP[rollout.stop], None)

    def _begin_step(self, state: PlanarState) -> PlanarState:
        """Take the reading after the section; the first reading of a walk is available immediately."""
        state = self._automaton.restart(state)
        latched = () if state.memory is None else state.memory.latched
        self._next = self._delay / READINGS
        self._pending.append(_PlanarReading(self._delay, state.q, state.v, latched))
        if self._latched is None:
            self._source.q, self._source.v, self._latched = state.q, state.v, latched
        return _latch(state, self._latched)

    def _update_reading(self, state: PlanarState) -> PlanarState:
        """Apply the readings that have arrived, and take a new reading if one is due."""
        if self._next <= state.time + SIMULTANEOUS:
            self._pending.append(_PlanarReading(state.time + self._delay, state.q, state.v, None))
            self._next = state.time + self._delay / READINGS
        while self._pending and self._pending[0].arrival <= state.time + SIMULTANEOUS:
            reading = self._pending.popleft()
            self._source.q, self._source.v = reading.q, reading.v
            if reading.latched is not None:
                self._latched = reading.latched
                state = _latch(state, reading.latched)
        return state

    def _end_step(self, rollout: PlanarRollout) -> PlanarWalkStep:
        """Exchange the legs in the state, in the pending readings and in the last one."""
        if rollout.stop is not Stop.EVENT_REACHED or rollout.end is None:
            return PlanarWalkStep(rollout, rollout.stop, None)
        matrix = np.eye(self._robot.n_q) if self._robot.mirror is None else self._robot.mirror.coordinates
        self._source.q, self._source.v = matrix @ self._source.q, matrix @ self._source.v
        self._pending = deque(
            _PlanarReading(reading.arrival - rollout.end.time, matrix @ reading.q, matrix @ reading.v, reading.latched)
            for reading in self._pending
        )
        return PlanarWalkStep(rollout, None, exchange_legs(rollout.end, self._robot, self._robot.mirror))


def _latch(state: PlanarState, latched: tuple[float, ...]) -> PlanarState:
    """Return a state whose law has these latched values."""
    return state if state.memory is None else replace(state, memory=state.memory._replace(latched=latched))
