"""Integration of one contact mode with parameters and law by heyoka, with the event rules of every engine.

heyoka reports every root of a guard in a step, including one at the start.  In gaitopt a guard that starts at zero is
an event only if it is negative immediately afterwards: a foot starts to slide from rest, a force starts on the boundary
of its cone, both feet touch the ground when a step begins.  Such guards are shifted by no more than rounding, so that
heyoka reports a root at the start only if it is an event.
"""

import functools
from collections.abc import Callable, Iterator
from threading import get_ident

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.torque_saturation import split_at_limits
from gaitopt.locks import cached_property, one_at_a_time
from gaitopt.model.contacts.event import SINGULAR, EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.active_piece import ActivePiece, pieces
from gaitopt.simulation.closed_loop import ClosedLoop, mode_equations
from gaitopt.simulation.taylor.compiled_programs import (
    VariationalProgram,
    program_with_events,
    program_with_variations,
)
from gaitopt.simulation.taylor.expression_conversion import heyoka_module

GUARD_TOLERANCE = 1e-9
"""A guard below zero by less than this at the start counts as zero; it is an event if it falls."""
TOUCHDOWN_TOLERANCE = 1e-13
"""If the touchdown guard at the start is below this in absolute value, both feet are on the ground."""
LIMIT_TOLERANCE = 1e-7
"""A torque within this distance [N m] of its limit counts as at its limit: it is known to about 1e-9 only, since the
expressions of the integrator are summed in another order than those of the law."""
DERIVATIVE_TOLERANCE = 1e-12
"""Smallest relative truncation error of a step of the variational equations, whose cost grows with the order."""
MAX_TAYLOR_STEPS = 10_000
"""Maximum number of Taylor steps between two checks that the integrator makes progress."""

_TOUCHDOWN, _LAW_SWITCH = EventKind.TOUCHDOWN, EventKind.LAW_SWITCH
_PAINLEVE, _REST = EventKind.PAINLEVE, EventKind.REST
# Names of the module are ten times faster than attributes of an Enum.

IntervalObserver = Callable[[Array, Array, Array, int], None]


class ModeIntegrator:
    """Integrator of one contact mode of a robot with given parameters under a law, for the thread that creates it.

    Parameters
    ----------
    loop : ClosedLoop
    mode : Mode
    tolerance : float
    compact_mode : bool
        As in :class:`gaitopt.simulation.taylor.heyoka_engine.HeyokaEngine`.

    Attributes
    ----------
    control : Function
        Function of the law; for a law with torque limits, the form in which kinks are switches.
    equations : ModeEquations
    current : (1 + n_y,) array
        Clock [s] and state, which :meth:`run` advances.
    """

    def __init__(self, loop: ClosedLoop, mode: Mode, tolerance: float, compact_mode: bool) -> None:
        robot, law = loop.robot, loop.law
        self.loop, self.control = loop, split_at_limits(law.control) if law.limited else law.control
        self.equations = mode_equations(robot, mode, self.control)
        guards = _move_parameters_last(self.equations.guards)
        memory = np.zeros(1 + loop.size + guards.numel_in(2))
        self.current, self._data = memory[: 1 + loop.size], memory[1 + loop.size :]
        self._y, self._watch = self.current[1:], FastCall(guards, loop.p, shared=memory)
        self._tolerance = tolerance
        self._program = program_with_events(robot, mode, self.control, tolerance, compact_mode, get_ident())
        self._events = self.equations.events
        self._shifts = self._program.numbers[-len(self._events) :]
        self._near = LIMIT_TOLERANCE if law.limited else GUARD_TOLERANCE
        self._active = ActivePiece(law, self.current, mode)
        self._ready: dict[tuple[int, tuple[float, ...]], tuple[Array, Array | None]] = {}
        outcomes = heyoka_module().taylor_outcome
        self._time_limit, self._step_limit = int(outcomes.time_limit), int(outcomes.step_limit)

    @cached_property
    def variations(self) -> VariationalProgram:
        """Integrator of the motion and its derivatives, without events."""
        tolerance = max(self._tolerance, DERIVATIVE_TOLERANCE)
        return program_with_variations(self.loop.robot, self.equations.mode, self.control, tolerance, get_ident())

    def intervals(self, clock: float, state: Array, until: float) -> Iterator[tuple[Array, float, float, Array | None]]:
        """Yield data, begin, end and jump of each interval between two clock times.

        The jump is that of a deviation at the start of the interval, (n_y, n_y), if the state decides the pieces of the
        law; None if deviations do not jump.
        """
        law = self.loop.law
        if not law.limited and law.index is None:
            for piece, begin, end in pieces(law, clock, until):
                yield law.table[:, piece], begin, end, None
            return
        recorded: list[tuple[Array, Array, Array]] = []
        self.current[0], self.current[1:] = clock, state
        self.walk(until, lambda column, before, after, steps: recorded.append((column, before, after.copy())))
        last: tuple[Array, Array] | None = None
        for column, before, after in recorded:
            jump = None if last is None or law.index is None else self._jump(last[0], column, last[1])
            yield column, before[0], after[0], jump
            last = column, after

    def _jump(self, old: Array, new: Array, current: Array) -> Array:
        flow, p = self.equations.flow, self.loop.p
        rates = [np.asarray(flow(current[0], current[1:], p, data)).ravel() for data in (old, new)]
        return np.eye(current.size - 1) + np.outer(rates[0] - rates[1], self.loop.piece_shift(rates[0]))

    def walk(self, until: float, observer: IntervalObserver | None = None) -> HybridEvent | None:
        """Integrate through the pieces of the law, starting from `current`, and return the final event.

        Parameters
        ----------
        until : float [s]
        observer : callable, optional
            Called with (data, `current` before, `current` after, Taylor steps) for each interval of constant data.
        """
        current, active = self.current, self._active
        start_clock = clock = current.item(0)
        active.begin()
        while clock < until:
            before = current if observer is None else current.copy()
            event, steps = self.run(active.end(until), first=clock == start_clock)
            clock = current.item(0)
            if observer is not None:
                observer(active.data, before, current, steps)
            event = active.advance(event)
            if event is not None:
                return event
        return None

    def run(self, end: float, *, first: bool) -> tuple[HybridEvent | None, int]:
        """Integrate over one piece of the law, or until a guard falls through zero.

        Parameters
        ----------
        end : float [s]
        first : bool
            Whether the phase begins at this instant.

        Returns
        -------
        event : HybridEvent or None
        steps : int
            Number of Taylor steps.
        """
        current, y, program, integrator = self.current, self._y, self._program, self._program.integrator
        watch = self._watch
        self._data[:], parameters = self._ready.get((self._active.piece, self._active.sides)) or self._prepare()
        *values, armed = watch.evaluate().tolist()
        program.numbers[:] = self._parameters() if parameters is None else parameters
        if not min(values) > self._near:
            event = self._check_guards_at_start(values, armed > 0, first)
            if event is not None:
                return event, 0
        program.state[:] = y[program.entries]
        integrator.time = current.item(0)
        integrator.reset_cooldowns()
        steps = 0
        while True:
            outcome = integrator.propagate_until(end, MAX_TAYLOR_STEPS)
            code, steps = int(outcome[0]), steps + outcome[3]
            if code < 0 and code >= -len(values):
                y[program.entries] = program.state
                current[0], event = integrator.time, self._events[~code]
                if event.kind is not _TOUCHDOWN or watch.evaluate().item(-1) > 0:
                    return event, steps
            elif code == self._time_limit:
                y[program.entries] = program.state
                current[0] = end
                return None, steps
            elif code != self._step_limit or integrator.last_h <= 1e-12 * (end - current[0]):
                self._integrate_to_failure()
                return SINGULAR, steps

    def _check_guards_at_start(self, values: list[float], armed: bool, first: bool) -> HybridEvent | None:
        """Shift guards that start at zero such that they are no event, or return the event of a negative guard."""
        for i, value in enumerate(values):
            if value > LIMIT_TOLERANCE:
                continue
            event = self._events[i]
            kind = event.kind
            if kind is _LAW_SWITCH and abs(value) < LIMIT_TOLERANCE:
                self._shifts[i] = LIMIT_TOLERANCE / 10 - min(value, 0)
                continue
            if value > GUARD_TOLERANCE:
                continue
            if kind is _PAINLEVE and value <= 0:
                return event
            if first and kind is _TOUCHDOWN:
                # A touchdown is no event at the start: the guard must rise above zero first.
                if abs(value) < TOUCHDOWN_TOLERANCE and (value <= 0 or not armed):
                    self._shifts[i] = -1e-15 - value
            elif -GUARD_TOLERANCE <= value <= 0:
                # The guard falls through the shifted zero immediately or rises; a resting foot has exactly zero speed.
                self._shifts[i] = (1e-16 if kind is _REST else 1e-14 * max(1, *map(abs, values))) - value
            elif value < -GUARD_TOLERANCE and kind is not _TOUCHDOWN:
                return event
        return None

    def _integrate_to_failure(self) -> None:
        """Integrate until a step fails, and set clock and state to the last finite ones."""
        current, y, program, integrator = self.current, self._y, self._program, self._program.integrator
        program.state[:] = y[program.entries]
        integrator.time = current[0]
        integrator.reset_cooldowns()
        for _ in range(MAX_TAYLOR_STEPS):
            integrator.step()
            if not np.all(np.isfinite(program.state)):
                break
            current[0], y[program.entries] = integrator.time, program.state

    def _prepare(self) -> tuple[Array, Array | None]:
        """Return the data and the integrator's parameters, None if these depend on the state."""
        ready = self._active.data, None if self._program.depends_on_state else self._parameters()
        self._ready[self._active.piece, self._active.sides] = ready
        return ready

    def _parameters(self) -> Array:
        return self._program.parameters(self.loop.p, self._active.data, self._y)


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _move_parameters_last(guards: ca.Function) -> ca.Function:
    """Return the guards as a Function of (t, y, data, p), with the constant input last."""
    t, y, p, data = guards.sx_in()
    return ca.Function("guards", [t, y, data, p], guards.call([t, y, p, data]))


@functools.lru_cache(maxsize=128)
@one_at_a_time
def mode_integrator(
    robot: Robot, law: Law, mode: Mode, p: bytes, tolerance: float, compact_mode: bool, thread: int
) -> ModeIntegrator:
    """Return the integrator of a mode for a parameter vector given as bytes; it is created once per thread."""
    return ModeIntegrator(ClosedLoop(robot, law, np.frombuffer(p)), mode, tolerance, compact_mode)
