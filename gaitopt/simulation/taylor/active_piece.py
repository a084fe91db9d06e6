"""What of a law is in force along a motion: its piece, and the sides on which the fast engine finds torques limited."""

from bisect import bisect_right

import numpy as np

from gaitopt.control.law import Law
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.simulation.active_piece import MOST_SWITCHES, following_piece
from gaitopt.simulation.closed_loop import SWITCH, demand_of


class TaylorActivePiece:
    """The piece of a law and the sides of its actuators.

    Parameters
    ----------
    law : Law
    mode : Mode
    here : (1 + n_y,) array
        Clock [s] and state, shared with whoever moves on.

    Attributes
    ----------
    piece : int
    sides : tuple of float
        Of each actuator, as in :func:`gaitopt.control.limits.split_at_limits`; empty for a law without limits.
    """

    def __init__(self, law: Law, mode: Mode, here: Array) -> None:
        self._law, self._here = law, here
        self._breaks, self._last = law.breakpoints.tolist(), law.breakpoints.size - 1
        self._measure = 0 if law.index is None else 1 + law.index
        self._demand = None if law.demand is None else FastCall(demand_of(law.demand, mode))
        self._switched, self._repeats = np.nan, 0
        self.piece, self.sides = 0, tuple[float, ...]()

    def begin(self) -> None:
        """Find out what is in force here, where a motion begins."""
        self._switched, self._repeats = np.nan, 0
        self._take(bisect_right(self._breaks, self._here.item(self._measure)) - 1)

    @property
    def column(self) -> Array:
        """The data in force: a column of the table, and the sides of the actuators."""
        column = self._law.table[:, self.piece]
        return np.append(column, self.sides) if self.sides else column

    def end(self, until: float) -> float:
        """Return when the piece ends to be; one that does not go by the clock is ended by a guard."""
        if self.piece >= self._last or self._measure:
            return until
        return min(until, self._breaks[self.piece + 1])

    def advance(self, event: str | None) -> str | None:
        """Take what is in force after this piece, or after a guard of the law; return any other event.

        Changes at one instant, again and again, end in ``"singular"``.
        """
        if event is None:
            self._take(self.piece + 1)
        elif event.startswith(SWITCH):
            self._repeats = self._repeats + 1 if self._here[0] == self._switched else 0
            self._switched = self._here[0]
            if self._repeats > MOST_SWITCHES:
                return "singular"
            self._switch(int(event.removeprefix(SWITCH)))
            return None
        return event

    def _switch(self, number: int) -> None:
        count = len(self.sides)
        if number >= 2 * count:
            self._take(self.piece + following_piece(number - 2 * count))
            return
        sides = list(self.sides)
        actuator, beyond = number % count, number < count
        sides[actuator] = 0.0 if sides[actuator] else 1.0 if beyond else -1.0
        self.sides = tuple(sides)

    def _take(self, piece: int) -> None:
        self.piece = min(max(piece, 0), self._last)
        if self._demand is not None:
            column = self._law.table[:, self.piece]
            demand = self._demand(self._here[0], self._here[1:], column)[0]
            limits = column[-demand.size :]
            self.sides = tuple(np.where(np.abs(demand) > limits, np.sign(demand), 0.0).tolist())
