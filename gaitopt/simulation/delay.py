"""Walks whose law reads the state as it was some time ago.

A sensor takes readings at equal intervals, and each reaches the law after the delay, which uses it until the next one
comes: between arrivals what the law reads is constant, so a walk is an ordinary differential equation from arrival to
arrival and is integrated as exactly as any.  A pure delay would be one of infinite dimension.
"""

from collections import deque
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, latched_size
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Arc, Engine

READINGS = 4
"""Readings taken in the time of one delay, so that what the law reads is 1 to 1.25 delays old."""
SIMULTANEOUS = 1e-12
"""Times nearer to each other than this are one [s]."""


def delay_readings(law: Law) -> Law:
    """Return a law that takes its state from the first values it holds over a step, to be set by :class:`DelayedReadings`.

    Parameters
    ----------
    law : Law
        The clock, reset at touchdown, is its own and not late; nor is the sign of the slide, for laws that want it.
    """
    size = 2 * law.torque.size1_in(1)
    held, slide = ca.SX.sym("held", size + latched_size(law.torque)), ca.SX.sym("slide")

    def late(function: ca.Function) -> ca.Function:
        clock, q, v, data = function.sx_in()[:4]
        more = [held[size:], slide] if function.n_in() > 4 else []
        outputs = function.call([clock, held[: size // 2], held[size // 2 : size], data, *more])
        return ca.Function(function.name(), [clock, q, v, data, held, slide], outputs)

    _, q, v, data = law.torque.sx_in()[:4]
    own = [] if law.hold is None else [law.hold(q, v, data)]
    return replace(
        law,
        torque=late(law.torque),
        hold=ca.Function("hold", [q, v, data], [ca.vertcat(q, v, *own)]),
        demand=law.demand and late(law.demand),
        index=None if law.index is None else size + law.index,
    )


class _Reading(NamedTuple):
    """What arrives at a time: a state (q, v), and what the law holds from then on, if it was read at a touchdown."""

    arrival: float
    state: Array
    own: Array | None


class DelayedReadings:
    """An engine for one walk under a law made by :func:`delay_readings`: it sets what the law reads at each arrival.

    At a touchdown readings under way change their legs as the robot does.  What a law holds over a step it takes from
    the state after the touchdown, when that arrives.

    Parameters
    ----------
    engine : Engine
    delay : float [s]
    """

    def __init__(self, engine: Engine, delay: float) -> None:
        self.name, self._engine, self._delay = engine.name, engine, delay
        self._under_way = deque[_Reading]()
        self._held: Array = np.empty(0)
        self._landed, self._next = True, 0.0

    def flow(
        self,
        robot: Robot,
        law: Law,
        mode: Mode,
        clock: float,
        state: Array,
        p: Array,
        *,
        until: float,
        record: bool = False,
    ) -> Arc:
        """Integrate one contact mode from arrival to arrival; see :class:`gaitopt.simulation.engine.Engine`."""
        n, y, event = robot.n_q, np.array(state, dtype=float), None
        if self._landed:
            self._begin_step(y, n)
        arcs: list[Arc] = []
        while event is None and clock < until:
            self._take(clock, y, n)
            y[2 * n :] = self._held
            end = min([until, self._next, *[reading.arrival for reading in self._under_way]])
            arcs.append(self._engine.flow(robot, law, mode, clock, y, p, until=end, record=record))
            clock, y, event = arcs[-1].time.item(-1), arcs[-1].states[:, -1].copy(), arcs[-1].event
        if event == "touchdown":
            self._land(robot, clock, p)
        return _joined(arcs)

    def sensitivity(
        self, robot: Robot, law: Law, mode: Mode, clock: float, state: Array, p: Array, *, until: float
    ) -> Array:
        """Raise: the state of a walk with readings under way is more than (q, v)."""
        raise InputError("A walk whose readings are late has no derivative by its state alone.")

    def _begin_step(self, y: Array, n: int) -> None:
        """Read the state after a touchdown; the first of a walk is known at once."""
        self._landed, self._next = False, self._delay / READINGS
        if not self._held.size:
            self._held = y[2 * n :].copy()
        self._under_way.append(_Reading(self._delay, y[: 2 * n].copy(), y[4 * n :].copy()))

    def _take(self, clock: float, y: Array, n: int) -> None:
        """Take what has arrived, and the reading that is due."""
        if self._next <= clock + SIMULTANEOUS:
            self._under_way.append(_Reading(clock + self._delay, y[: 2 * n].copy(), None))
            self._next = clock + self._delay / READINGS
        while self._under_way and self._under_way[0].arrival <= clock + SIMULTANEOUS:
            reading = self._under_way.popleft()
            own = self._held[2 * n :] if reading.own is None else reading.own
            self._held = np.concatenate([reading.state, own])

    def _land(self, robot: Robot, clock: float, p: Array) -> None:
        """Let the readings under way, and the last one, change their legs, and count their time from the touchdown."""
        size = 2 * robot.n_q
        self._landed = True
        self._held[:size] = _swapped(robot, self._held[:size], p)
        self._under_way = deque(
            _Reading(reading.arrival - clock, _swapped(robot, reading.state, p), reading.own)
            for reading in self._under_way
        )


def _swapped(robot: Robot, state: Array, p: Array) -> Array:
    n = robot.n_q
    return np.concatenate([np.asarray(part).ravel() for part in robot.swap(state[:n], state[n:], p)])


def _joined(arcs: list[Arc]) -> Arc:
    """Return arcs that follow each other as one, their energies added up."""
    time = np.concatenate([arc.time if k == 0 else arc.time[1:] for k, arc in enumerate(arcs)])
    states = np.hstack([arc.states if k == 0 else arc.states[:, 1:] for k, arc in enumerate(arcs)])
    recorded = [arc.energy for arc in arcs if arc.energy is not None]
    if len(recorded) < len(arcs):
        return Arc(time[[0, -1]], states[:, [0, -1]], arcs[-1].event)
    energy = recorded[:1]
    for part in recorded[1:]:
        energy.append(energy[-1][:, -1:] + part[:, 1:])
    return Arc(time, states, arcs[-1].event, np.hstack(energy))
