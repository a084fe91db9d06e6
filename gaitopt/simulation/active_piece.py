"""Which piece of a law is in force along a motion."""

from collections.abc import Iterator

from gaitopt.control.law import Law
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import SWITCH

MOST_SWITCHES = 20
"""How often a law may change its form at one instant: its pieces, or the sides on which torques meet their limits."""


class ActivePiece:
    """The pieces of a law, followed along a motion.

    Parameters
    ----------
    law : Law
    clock : float [s]
    y : (n_y,) array
        State where the motion begins.

    Attributes
    ----------
    clock : float [s]
        How far the motion was followed.
    """

    def __init__(self, law: Law, clock: float, y: Array) -> None:
        self.clock, self._law, self._repeats = clock, law, 0
        self._piece = law.piece(law.measure(clock, y))

    @property
    def data(self) -> Array:
        """Column of the law's table in force, shape (n_d,)."""
        return self._law.table[:, self._piece]

    def end(self, until: float) -> float:
        """Return when it ends to be, `until` at the latest; a law that does not go by the clock ends it by a guard."""
        law, following = self._law, self._piece + 1
        if law.index is not None or following >= law.breakpoints.size:
            return until
        return min(until, float(law.breakpoints[following]))

    def advance(self, clock: float, event: str | None) -> str | None:
        """Take the next piece at the end of this one or at a guard of the law, and return any other event."""
        if event is None:
            self._piece = min(self._piece + 1, self._law.breakpoints.size - 1)
        elif event.startswith(SWITCH):
            self._repeats = self._repeats + 1 if clock == self.clock else 0
            if self._repeats > MOST_SWITCHES:
                return "singular"
            self._piece += following_piece(int(event.removeprefix(SWITCH)))
            event = None
        self.clock = clock
        return event


def following_piece(switch: int) -> int:
    """Return by how many pieces a law goes on where its lower (0) or upper (1) bound is met."""
    return 1 if switch else -1


def pieces(law: Law, clock: float, until: float) -> Iterator[tuple[int, float, float]]:
    """Yield (piece, begin, end) of the stretches of a law by the clock between two clock times."""
    while clock < until:
        piece = law.piece(clock)
        end = until if piece + 1 >= law.breakpoints.size else min(until, law.breakpoints[piece + 1])
        yield piece, clock, end
        clock = end
