"""One contact mode with parameters and law, watched by heyoka, with guards meaning what they mean everywhere.

heyoka reports every root of a guard in a step, one at the very start included, while a guard that starts at zero counts
only if it is negative right after: a foot slides on from rest, a force is released on the edge of its cone, both feet
touch the ground when a step begins.  Such guards are shifted, by no more than rounding, so that there is no root at the
start unless it counts.
"""

import functools
from bisect import bisect_right

import numpy as np

from gaitopt.control.law import Law
from gaitopt.model.buffered import Buffered
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import closed_loop
from gaitopt.simulation.heyoka_expressions import heyoka_module
from gaitopt.simulation.heyoka_programs import watching

ZERO = 1e-9
"""A guard this little below zero at the start was put there by rounding; whether it falls decides."""
TOUCHING = 1e-13
"""A touchdown guard this near zero at the start means that both feet are on the ground."""
PATIENCE = 10_000
"""Taylor steps after which an integrator must show that it gets on."""


class Phase:
    """One contact mode of a robot under a law with given parameters, ready to run.

    Parameters
    ----------
    robot : Robot
    law : Law
    mode : Mode
    p : (n_p,) array
    tolerance : float
    compact_mode : bool
        As in :class:`gaitopt.simulation.heyoka_engine.HeyokaEngine`.

    Attributes
    ----------
    loop : ClosedLoop
    here : (1 + n_y,) array
        Clock [s] and state, for :meth:`run` to change.
    """

    def __init__(self, robot: Robot, law: Law, mode: Mode, p: Array, tolerance: float, compact_mode: bool) -> None:
        self.robot, self.law, self.p = robot, law, p
        self.loop = closed_loop(robot, mode, law.torque)
        self.here = np.zeros(1 + self.loop.size)
        self._program = watching(robot, mode, law.torque, tolerance, compact_mode)
        self._names = self.loop.guard_names
        self._shifts = self._program.numbers[-len(self._names) :]
        self._breaks = law.breakpoints.tolist()
        self._watches: dict[int, Buffered] = {}
        self._rows: dict[int, Array] = {}
        outcomes = heyoka_module().taylor_outcome
        self._in_time, self._stuck = int(outcomes.time_limit), int(outcomes.step_limit)

    def piece(self, clock: float) -> int:
        """Return the piece of the law at a clock time."""
        return max(bisect_right(self._breaks, clock) - 1, 0)

    def end(self, piece: int, until: float) -> float:
        """Return when a piece of the law ends, `until` at the latest."""
        return min(until, self._breaks[piece + 1]) if piece + 1 < len(self._breaks) else until

    def run(self, piece: int, end: float, *, first: bool) -> tuple[str | None, int]:
        """Integrate over one piece of the law, or until a guard falls through zero.

        Parameters
        ----------
        piece : int
        end : float [s]
        first : bool
            Whether the phase begins here.

        Returns
        -------
        event : str or None
        steps : int
            Taylor steps taken.
        """
        here, program, integrator = self.here, self._program, self._program.integrator
        watch, y = self._watch(piece), here[1:]
        *values, armed = watch.packed(here).tolist()
        program.numbers[:] = self._row(piece, y)
        event = self._start(values, armed > 0, first)
        if event is not None:
            return event, 0
        program.state[:] = y[program.entries]
        integrator.time = here[0]
        integrator.reset_cooldowns()
        steps = 0
        while True:
            outcome = integrator.propagate_until(end, PATIENCE)
            code, steps = int(outcome[0]), steps + outcome[3]
            if code == self._stuck and integrator.last_h > 1e-12 * (end - here[0]):
                continue
            if code != self._in_time and not -len(self._names) <= code < 0:
                self._last_finite()
                return "singular", steps
            y[program.entries] = program.state
            if code == self._in_time:
                here[0] = end
                return None, steps
            here[0], event = integrator.time, self._names[~code]
            if event != "touchdown" or watch.packed(here)[-1] > 0:
                return event, steps

    def _start(self, values: list[float], armed: bool, first: bool) -> str | None:
        """Shift guards that start at zero to the side where they do not count, or return one that is negative."""
        for i, value in enumerate(values):
            if value > ZERO:
                continue
            name = self._names[i]
            if first and name in ("touchdown", "painleve"):
                # Never an event where it starts: from below zero it must rise first.
                if abs(value) < TOUCHING and (value <= 0 or not armed):
                    self._shifts[i] = -1e-15 - value
            elif -ZERO <= value <= 0:
                # Falls through the shifted zero at once, or rises; a resting foot's speed is an exact zero.
                self._shifts[i] = (1e-16 if name == "at rest" else 1e-14 * max(1, *map(abs, values))) - value
            elif value < -ZERO and name not in ("touchdown", "painleve"):
                return name
        return None

    def _last_finite(self) -> None:
        """Integrate until a step fails; change clock and state to the last good ones."""
        here, program, integrator = self.here, self._program, self._program.integrator
        y = here[1:]
        program.state[:] = y[program.entries]
        integrator.time = here[0]
        integrator.reset_cooldowns()
        for _ in range(PATIENCE):
            integrator.step()
            if not np.all(np.isfinite(program.state)):
                break
            here[0], y[program.entries] = integrator.time, program.state

    def _watch(self, piece: int) -> Buffered:
        if piece not in self._watches:
            self._watches[piece] = Buffered(self.loop.guards, self.p, self.law.table[:, piece])
        return self._watches[piece]

    def _row(self, piece: int, y: Array) -> Array:
        if piece not in self._rows or self._program.rest_matters:
            self._rows[piece] = self._program.row(self.p, self.law.table[:, piece], y)
        return self._rows[piece]


@functools.lru_cache(maxsize=128)
def phase_of(robot: Robot, law: Law, mode: Mode, p: bytes, tolerance: float, compact_mode: bool) -> Phase:
    """Return the phase of a mode for a parameter vector given as bytes; made once."""
    return Phase(robot, law, mode, np.frombuffer(p), tolerance, compact_mode)
