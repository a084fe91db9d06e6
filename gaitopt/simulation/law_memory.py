"""The memory of a law along a walk: values latched at the touchdown and at the law's events.

Several events may occur at one instant, because a guard of the new discrete state may be negative from its beginning.
Resets are then applied until no guard is negative, so that every event time of a walk is differentiable in the state
that causes the event.
"""

import functools

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.locks import cached_property, one_at_a_time
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array

MAX_EVENTS = 20
"""Maximum number of events of a law at one instant."""
GUARD_TOLERANCE = 1e-9
"""A guard below zero by less than this counts as zero."""


class LawMemory:
    """Computes the latched values of a law at the touchdown and at its events.

    Parameters
    ----------
    law : Law
    """

    def __init__(self, law: Law) -> None:
        self._law, self._n, self._events = law, law.control.size1_in(1), law.memory.events
        self._latch = FastCall(law.memory.latch, law.table[:, 0]) if law.memory.values else None

    @cached_property
    def _reset(self) -> FastCall:
        return FastCall(self._law.memory.reset)

    @cached_property
    def _guards(self) -> FastCall:
        return FastCall(_guards(self._law.control))

    def begin(self, state: Array) -> Array:
        """Return the state y = (q, v, latched) at the start of a step, from (q, v) after the touchdown."""
        if self._latch is None:
            return np.array(state, dtype=float)
        n = self._n
        y = np.concatenate((state, self._latch(state[:n], state[n:])[0]))
        return self.apply_events(0.0, y)

    def apply_event(self, event: int, clock: float, y: Array) -> Array:
        """Return the state after an event of the law and those that follow at the same instant, shape (n_y,)."""
        return self._apply_events(clock, self._reset_latched(event, clock, y))[0]

    def apply_events(self, clock: float, y: Array) -> Array:
        """Return the state after all events with a negative guard, shape (n_y,)."""
        return self._apply_events(clock, y)[0] if self._events else y

    def slope_at_start(self, state: Array) -> Array:
        """Return d y / d (q, v) at the start of a step, shape (n_y, 2 n_q)."""
        n, law = self._n, self._law
        if self._latch is None:
            return np.eye(2 * n)
        slope = np.asarray(_latch_slope(law.memory.latch)(state[:n], state[n:], law.table[:, 0]))
        y = np.concatenate((state, self._latch(state[:n], state[n:])[0]))
        matrix: Array = self._apply_events(0.0, y)[1] @ np.vstack([np.eye(2 * n), slope])
        return matrix

    def slopes(self, event: int, clock: float, y: Array) -> tuple[Array, Array]:
        """Return d y+ / d y, (n_y, n_y), and d y+ / d clock, (n_y,), of the state y+ after an event."""
        matrix, drift = self._slopes(event, clock, y)
        _, further, rate = self._apply_events(clock, self._reset_latched(event, clock, y))
        return further @ matrix, further @ drift + rate

    def _reset_latched(self, event: int, clock: float, y: Array) -> Array:
        n, data = self._n, self._law.data(clock, y)
        values = self._reset(clock, y[:n], y[n : 2 * n], y[2 * n :], data)[0]
        count = y.size - 2 * n
        return np.concatenate((y[: 2 * n], values[count * event : count * (event + 1)]))

    def _apply_events(self, clock: float, y: Array) -> tuple[Array, Array, Array]:
        """Return the state after all events with a negative guard, and its derivatives in state and clock."""
        matrix, drift = np.eye(y.size), np.zeros(y.size)
        for _ in range(MAX_EVENTS):
            values = self._guards(clock, y, self._law.data(clock, y))[0]
            below = np.flatnonzero(values < -GUARD_TOLERANCE)
            if not below.size:
                return y, matrix, drift
            event = int(below[0])
            slope, rate = self._slopes(event, clock, y)
            matrix, drift = slope @ matrix, slope @ drift + rate
            y = self._reset_latched(event, clock, y)
        raise InputError(
            f"The law {self._law.name!r} has more than {MAX_EVENTS} events at one instant, {clock:g} s after the "
            f"touchdown; its events trigger each other: {', '.join(self._events)}."
        )

    def _slopes(self, event: int, clock: float, y: Array) -> tuple[Array, Array]:
        jacobian, drift = _reset_slopes(self._law.memory.reset, event)(clock, y, self._law.data(clock, y))
        return np.asarray(jacobian), np.asarray(drift).ravel()


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _guards(control: ca.Function) -> ca.Function:
    """Return (clock, y, data) -> guards of a law's events."""
    n = control.size1_in(1)
    clock, y = ca.SX.sym("clock"), ca.SX.sym("y", 2 * n + control.size1_in(3))
    data = ca.SX.sym("data", control.size1_in(5))
    guards = control(clock, y[:n], y[n : 2 * n], y[2 * n :], 0, data)[2]
    return ca.Function("guards", [clock, y, data], [ca.densify(guards)])


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _latch_slope(latch: ca.Function) -> ca.Function:
    """Return (q, v, data) -> d latched / d (q, v), shape (n_l, 2 n_q)."""
    q, v, data = latch.sx_in()
    return ca.Function("latch_slope", [q, v, data], [ca.densify(ca.jacobian(latch(q, v, data), ca.vertcat(q, v)))])


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _reset_slopes(reset: ca.Function, event: int) -> ca.Function:
    """Return (clock, y, data) -> d y+ / d y, (n_y, n_y), and d y+ / d clock, (n_y,), of one event."""
    n = reset.size1_in(1)
    clock, y = ca.SX.sym("clock"), ca.SX.sym("y", 2 * n + reset.size1_in(3))
    data = ca.SX.sym("data", reset.size1_in(4))
    values = reset(clock, y[:n], y[n : 2 * n], y[2 * n :], data)[:, event]
    after = ca.vertcat(y[: 2 * n], values)
    return ca.Function("reset_slopes", [clock, y, data], [ca.jacobian(after, y), ca.jacobian(after, clock)])
