"""The active piece of a law along a motion, and the sides of its actuators."""

from bisect import bisect_right
from collections.abc import Iterator

import numpy as np

from gaitopt.control.law import Law
from gaitopt.model.contacts.event import SINGULAR, EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import torque_of

MAX_SWITCHES = 20
"""Maximum number of changes of the piece or of an actuator's side at one instant."""
_LAW_SWITCH = EventKind.LAW_SWITCH


class ActivePiece:
    """Tracks the active piece of a law along a motion.

    Parameters
    ----------
    law : Law
    current : (1 + n_y,) array
        Clock [s] and state, shared with the integrator that advances them.
    sides_in : Mode, optional
        Contact mode in which the sides of the actuators are tracked as well, as in
        :func:`gaitopt.control.torque_saturation.split_at_limits`; by default the law applies the torque limits.

    Attributes
    ----------
    piece : int
    sides : tuple of float
        Side of each actuator; empty for a law without limits, or if sides are not tracked.
    """

    def __init__(self, law: Law, current: Array, sides_in: Mode | None = None) -> None:
        self._law, self._current = law, current
        self._breaks, self._last = law.breakpoints.tolist(), law.breakpoints.size - 1
        self._measure = 0 if law.index is None else 1 + law.index
        track = law.limited and sides_in is not None
        self._demand = FastCall(torque_of(law.control, sides_in)) if track else None
        self._switched, self._repeats = np.nan, 0
        self.piece, self.sides = 0, tuple[float, ...]()

    def begin(self) -> None:
        """Determine the active piece and the sides at the start of a motion."""
        self._switched, self._repeats = np.nan, 0
        if self._last or self._demand is not None:
            self._enter(bisect_right(self._breaks, self._current.item(self._measure)) - 1)

    @property
    def data(self) -> Array:
        """Active column of the table, followed by the sides of the actuators if they are tracked."""
        column = self._law.table[:, self.piece]
        return np.append(column, self.sides) if self.sides else column

    def end(self, until: float) -> float:
        """Return the planned end of the piece, at most `until`; if the state decides the piece, a guard ends it."""
        if self.piece >= self._last or self._measure:
            return until
        return min(until, self._breaks[self.piece + 1])

    def advance(self, event: HybridEvent | None) -> HybridEvent | None:
        """Enter the next piece at the end of this one or at a switch; return any other event.

        More than `MAX_SWITCHES` changes at one instant return `SINGULAR`.
        """
        if event is None:
            self._enter(self.piece + 1)
        elif event.kind is _LAW_SWITCH:
            self._repeats = self._repeats + 1 if self._current[0] == self._switched else 0
            self._switched = self._current[0]
            if self._repeats > MAX_SWITCHES:
                return SINGULAR
            self._switch(event.number)
            return None
        return event

    def _switch(self, number: int) -> None:
        count = len(self.sides)
        if number >= 2 * count:
            self._enter(self.piece + (1 if number - 2 * count else -1))  # upper bound, otherwise lower bound
            return
        sides = list(self.sides)
        actuator, beyond = number % count, number < count
        sides[actuator] = 0.0 if sides[actuator] else 1.0 if beyond else -1.0
        self.sides = tuple(sides)

    def _enter(self, piece: int) -> None:
        self.piece = min(max(piece, 0), self._last)
        if self._demand is not None:
            column = self._law.table[:, self.piece]
            demand = self._demand(self._current[0], self._current[1:], column)[0]
            limits = column[-demand.size :]
            self.sides = tuple(np.where(np.abs(demand) > limits, np.sign(demand), 0.0).tolist())


def pieces(law: Law, clock: float, until: float) -> Iterator[tuple[int, float, float]]:
    """Yield (piece, begin, end) of the pieces of a clock-based law between two clock times."""
    while clock < until:
        piece = law.piece(clock)
        end = until if piece + 1 >= law.breakpoints.size else min(until, law.breakpoints[piece + 1])
        yield piece, clock, end
        clock = end
