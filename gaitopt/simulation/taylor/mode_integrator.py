"""One contact mode with parameters and law, watched by heyoka, with guards meaning what they mean everywhere.

heyoka reports every root of a guard in a step, one at the very start included, while a guard that starts at zero counts
only if it is negative right after: a foot slides on from rest, a force is released on the edge of its cone, both feet
touch the ground when a step begins.  Such guards are shifted, by no more than rounding, so that there is no root at the
start unless it counts.
"""

import functools
from collections.abc import Callable, Iterator
from threading import get_ident

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.limits import split_at_limits
from gaitopt.model.contacts.event import SINGULAR, EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.active_piece import ActivePiece, pieces
from gaitopt.simulation.closed_loop import ClosedLoop, mode_equations
from gaitopt.simulation.taylor.compiled_programs import program_with_events
from gaitopt.simulation.taylor.expression_conversion import heyoka_module

ZERO = 1e-9
"""A guard this little below zero at the start was put there by rounding; whether it falls decides."""
TOUCHING = 1e-13
"""A touchdown guard this near zero at the start means that both feet are on the ground."""
AT_LIMIT = 1e-7
"""A torque this near [N m] to where it meets or leaves its limit is there: it is known to about 1e-9 only, since the
integrator's expressions are other sums than the law's."""
MAX_FAILED_STARTS = 10_000
"""Taylor steps after which an integrator must show that it gets on."""

Tape = Callable[[Array, Array, Array, int], None]


class ModeIntegrator:
    """One contact mode of a robot under a law with given parameters, ready to run in the thread that makes it.

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
        That of the law; of a law with limits, the one whose kinks are switches.
    equations : ModeEquations
    here : (1 + n_y,) array
        Clock [s] and state, for :meth:`run` to change.
    """

    def __init__(self, loop: ClosedLoop, mode: Mode, tolerance: float, compact_mode: bool) -> None:
        robot, law = loop.robot, loop.law
        self.loop, self.control = loop, split_at_limits(law.control) if law.limited else law.control
        self.equations = mode_equations(robot, mode, self.control)
        guards = _parameters_last(self.equations.guards)
        memory = np.zeros(1 + loop.size + guards.numel_in(2))
        self.here, self._data = memory[: 1 + loop.size], memory[1 + loop.size :]
        self._y, self._watch = self.here[1:], FastCall(guards, loop.p, shared=memory)
        self._program = program_with_events(robot, mode, self.control, tolerance, compact_mode, get_ident())
        self._events = self.equations.events
        self._shifts = self._program.numbers[-len(self._events) :]
        self._near = AT_LIMIT if law.limited else ZERO
        self._active = ActivePiece(law, self.here, mode)
        self._ready: dict[tuple[int, tuple[float, ...]], tuple[Array, Array | None]] = {}
        outcomes = heyoka_module().taylor_outcome
        self._in_time, self._stuck = int(outcomes.time_limit), int(outcomes.step_limit)

    def stretches(self, clock: float, state: Array, until: float) -> Iterator[tuple[Array, float, float, Array | None]]:
        """Yield the data of each interval between two clock times, with its begin and end.

        Last comes the jump of a deviation at its begin, (n_y, n_y), if the state decides the pieces of the law; None if
        deviations do not jump.
        """
        law = self.loop.law
        if not law.limited and law.index is None:
            for piece, begin, end in pieces(law, clock, until):
                yield law.table[:, piece], begin, end, None
            return
        taken: list[tuple[Array, Array, Array]] = []
        self.here[0], self.here[1:] = clock, state
        self.walk(until, lambda column, before, after, steps: taken.append((column, before, after.copy())))
        last: tuple[Array, Array] | None = None
        for column, before, after in taken:
            jump = None if last is None or law.index is None else self._jump(last[0], column, last[1])
            yield column, before[0], after[0], jump
            last = column, after

    def _jump(self, old: Array, new: Array, here: Array) -> Array:
        flow, p = self.equations.flow, self.loop.p
        rates = [np.asarray(flow(here[0], here[1:], p, data)).ravel() for data in (old, new)]
        return np.eye(here.size - 1) + np.outer(rates[0] - rates[1], self.loop.piece_shift(rates[0]))

    def walk(self, until: float, tape: Tape | None = None) -> HybridEvent | None:
        """Integrate through the pieces of the law, from what is in `here`, and return the event that ended it.

        Parameters
        ----------
        until : float [s]
        tape : callable, optional
            Called with (data, `here` before, `here` after, Taylor steps) for each interval between changes of the
            data.
        """
        here, active = self.here, self._active
        began = clock = here.item(0)
        active.begin()
        while clock < until:
            before = here if tape is None else here.copy()
            event, steps = self.run(active.end(until), first=clock == began)
            clock = here.item(0)
            if tape is not None:
                tape(active.data, before, here, steps)
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
            Whether the phase begins here.

        Returns
        -------
        event : HybridEvent or None
        steps : int
            Taylor steps taken.
        """
        here, y, program, integrator = self.here, self._y, self._program, self._program.integrator
        watch = self._watch
        self._data[:], row = self._ready.get((self._active.piece, self._active.sides)) or self._prepare()
        *values, armed = watch.evaluate().tolist()
        program.numbers[:] = self._row() if row is None else row
        if not min(values) > self._near:
            event = self._start(values, armed > 0, first)
            if event is not None:
                return event, 0
        program.state[:] = y[program.entries]
        integrator.time = here.item(0)
        integrator.reset_cooldowns()
        steps = 0
        while True:
            outcome = integrator.propagate_until(end, MAX_FAILED_STARTS)
            code, steps = int(outcome[0]), steps + outcome[3]
            if code < 0 and code >= -len(values):
                y[program.entries] = program.state
                here[0], event = integrator.time, self._events[~code]
                if event.kind is not EventKind.TOUCHDOWN or watch.evaluate().item(-1) > 0:
                    return event, steps
            elif code == self._in_time:
                y[program.entries] = program.state
                here[0] = end
                return None, steps
            elif code != self._stuck or integrator.last_h <= 1e-12 * (end - here[0]):
                self._last_finite()
                return SINGULAR, steps

    def _start(self, values: list[float], armed: bool, first: bool) -> HybridEvent | None:
        """Shift guards that start at zero to the side where they do not count, or return one that is negative."""
        for i, value in enumerate(values):
            event = self._events[i]
            if abs(value) < AT_LIMIT and event.kind is EventKind.LAW_SWITCH:
                self._shifts[i] = AT_LIMIT / 10 - min(value, 0)
                continue
            if value > ZERO:
                continue
            if event.kind is EventKind.PAINLEVE and value <= 0:
                return event
            if first and event.kind is EventKind.TOUCHDOWN:
                # Never an event where it starts: from below zero it must rise first.
                if abs(value) < TOUCHING and (value <= 0 or not armed):
                    self._shifts[i] = -1e-15 - value
            elif -ZERO <= value <= 0:
                # Falls through the shifted zero at once, or rises; a resting foot's speed is an exact zero.
                self._shifts[i] = (1e-16 if event.kind is EventKind.REST else 1e-14 * max(1, *map(abs, values))) - value
            elif value < -ZERO and event.kind is not EventKind.TOUCHDOWN:
                return event
        return None

    def _last_finite(self) -> None:
        """Integrate until a step fails; change clock and state to the last good ones."""
        here, y, program, integrator = self.here, self._y, self._program, self._program.integrator
        program.state[:] = y[program.entries]
        integrator.time = here[0]
        integrator.reset_cooldowns()
        for _ in range(MAX_FAILED_STARTS):
            integrator.step()
            if not np.all(np.isfinite(program.state)):
                break
            here[0], y[program.entries] = integrator.time, program.state

    def _prepare(self) -> tuple[Array, Array | None]:
        """Return the data, and the integrator's numbers unless they depend on the state."""
        ready = self._active.data, None if self._program.rest_matters else self._row()
        self._ready[self._active.piece, self._active.sides] = ready
        return ready

    def _row(self) -> Array:
        return self._program.row(self.loop.p, self._active.data, self._y)


@functools.lru_cache(maxsize=128)
def _parameters_last(guards: ca.Function) -> ca.Function:
    """Return (t, y, data, p) -> the same: what never changes comes last."""
    t, y, p, data = guards.sx_in()
    return ca.Function("guards", [t, y, data, p], guards.call([t, y, p, data]))


@functools.lru_cache(maxsize=128)
def mode_integrator(
    robot: Robot, law: Law, mode: Mode, p: bytes, tolerance: float, compact_mode: bool, thread: int
) -> ModeIntegrator:
    """Return the phase of a mode for a parameter vector given as bytes; made once in each thread."""
    return ModeIntegrator(ClosedLoop(robot, law, np.frombuffer(p)), mode, tolerance, compact_mode)
