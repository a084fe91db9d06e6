"""Walks under a law that reads the state with a delay.

A sensor takes readings at equal intervals, and each reading reaches the law after the delay; the law uses it until the
next one arrives.  Between arrivals the law reads constants, so a walk obeys an ordinary differential equation from
arrival to arrival and is integrated with the usual accuracy.  A pure delay would have a state of infinite dimension.
"""

from collections import deque
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.signature import control_function, inputs_of, make_memory
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Arc, Engine, join_arcs
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.simulation.step_limits import StepLimits

READINGS = 4
"""Number of readings per delay; the state that the law reads is 1 to 1.25 delays old."""
SIMULTANEOUS = 1e-12
"""Times that differ by less than this are equal [s]."""


def delay_readings(law: Law) -> Law:
    """Return a law that reads its state from its first latched values, which :class:`DelayedWalker` sets.

    Parameters
    ----------
    law : Law
        Its clock, reset at touchdown, and the sign of the slide are not delayed.
    """
    n = law.control.size1_in(1)
    inputs = inputs_of(law.control, latched=2 * n)
    reading, inner = inputs.latched[: 2 * n], inputs.latched[2 * n :]
    delayed = inputs._replace(q=reading[:n], v=reading[n:], latched=inner)
    torque, bounds, guards = law.control(*delayed)
    events = law.memory.events
    inner_reset = law.memory.reset(*delayed[:4], delayed.data)
    memory = make_memory(
        inputs,
        ca.vertcat(inputs.q, inputs.v, law.memory.latch(inputs.q, inputs.v, inputs.data)),
        values=[*(f"reading {i}" for i in range(2 * n)), *law.memory.values],
        events=events,
        reset=ca.vertcat(ca.repmat(reading, 1, len(events)), inner_reset),
    )
    control = control_function(inputs, torque, bounds=bounds, guards=guards)
    return replace(law, control=control, memory=memory, index=None if law.index is None else 2 * n + law.index)


class _Reading(NamedTuple):
    """A state (q, v) and its time of arrival; a reading of a touchdown also contains the values latched by the law."""

    arrival: float
    state: Array
    latched: Array | None


class DelayedWalker:
    """A walker whose law reads the state with a delay, for one walk; pending readings are kept from step to step.

    At a touchdown the legs are exchanged in the pending readings as in the robot.  The law latches the values of a
    touchdown when the reading of that touchdown arrives.  The state of such a walk contains more than (q, v), so it has
    neither a return map nor a derivative.

    Parameters
    ----------
    robot : Robot
    law : Law
    p : (n_p,) array
    engine : Engine
    delay : float [s]
    step_limits : StepLimits, optional
    """

    def __init__(
        self, robot: Robot, law: Law, p: Array, engine: Engine, *, delay: float, step_limits: StepLimits | None = None
    ) -> None:
        self._walker = Walker(robot, delay_readings(law), p, engine, step_limits=step_limits)
        self.robot, self.law, self.p, self.engine, self.delay = robot, self._walker.law, p, engine, delay
        self._pending = deque[_Reading]()
        self._reading: Array = np.empty(0)
        self._latched = np.zeros(0)
        self._begin, self._next = True, 0.0

    def torque(self, mode: Mode, clock: float, y: Array) -> Array:
        """Return the torque in a contact mode at a clock time and state y, shape (n_u,) [N m]."""
        return self._walker.torque(mode, clock, y)

    def torques(self, mode: Mode, times: Array, states: Array) -> Array:
        """Return the torques at clock times (K,) and states (n_y, K), shape (n_u, K) [N m]."""
        return self._walker.torques(mode, times, states)

    def walk_step(self, state: Array, *, record: bool = False) -> WalkStep:
        """Simulate the next step of the walk; see :meth:`gaitopt.simulation.hybrid_automaton.Walker.walk_step`."""
        self._begin = True
        walk_step = self._walker.walk_step(state, record=record, flow=self._flow)
        if walk_step.following is not None:
            self._touch_down(walk_step)
        return walk_step

    def _flow(self, mode: Mode, clock: float, state: Array, until: float, record: bool) -> Arc:
        """Integrate one contact mode from arrival to arrival."""
        n, y, event = self.robot.n_q, np.array(state, dtype=float), None
        if self._begin:
            self._begin_step(y, n)
        arcs: list[Arc] = []
        while event is None and clock < until:
            self._update_reading(clock, y, n)
            end = min([until, self._next, *[reading.arrival for reading in self._pending]])
            arcs.append(self.engine.flow(self._walker.loop, mode, clock, y, until=end, record=record))
            clock, y, event = arcs[-1].time.item(-1), arcs[-1].states[:, -1].copy(), arcs[-1].event
        return join_arcs(arcs)

    def _begin_step(self, y: Array, n: int) -> None:
        """Take the reading after a touchdown; the first reading of a walk is available immediately."""
        self._begin, self._next = False, self.delay / READINGS
        self._pending.append(_Reading(self.delay, y[: 2 * n].copy(), y[4 * n :].copy()))
        if not self._reading.size:
            self._reading = y[2 * n : 4 * n].copy()
        else:
            y[4 * n :] = self._latched

    def _update_reading(self, clock: float, y: Array, n: int) -> None:
        """Apply the readings that have arrived, and take a new reading if one is due."""
        if self._next <= clock + SIMULTANEOUS:
            self._pending.append(_Reading(clock + self.delay, y[: 2 * n].copy(), None))
            self._next = clock + self.delay / READINGS
        while self._pending and self._pending[0].arrival <= clock + SIMULTANEOUS:
            reading = self._pending.popleft()
            self._reading = reading.state
            if reading.latched is not None:
                y[4 * n :] = reading.latched
        y[2 * n : 4 * n] = self._reading

    def _touch_down(self, walk_step: WalkStep) -> None:
        """Exchange the legs in the pending readings and in the last one, and restart the clock at the touchdown."""
        self._reading = _swap_legs(self.robot, self._reading, self.p)
        self._latched = walk_step.arcs[-1][1].states[4 * self.robot.n_q :, -1].copy()
        self._pending = deque(
            _Reading(
                reading.arrival - walk_step.duration, _swap_legs(self.robot, reading.state, self.p), reading.latched
            )
            for reading in self._pending
        )


def _swap_legs(robot: Robot, state: Array, p: Array) -> Array:
    n = robot.n_q
    return np.concatenate([np.asarray(part).ravel() for part in robot.swap(state[:n], state[n:], p)])
