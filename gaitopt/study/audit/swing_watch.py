"""Swings in which a contact is below the ground while it is armed, for the second replay."""

from collections.abc import Callable
from enum import StrEnum
from functools import partial
from typing import NamedTuple

from gaitopt.motion.motion import Array
from gaitopt.study.audit.contact_solver import ContactSolver
from gaitopt.study.audit.dense_call import DenseCall

LEAST = 1e-6
"""Depth [m] from which an armed contact is below the ground."""


class ReplayGuardKind(StrEnum):
    """Kind of a guard of the second replay."""

    GAP = "gap"
    LIFT_OFF = "lift"
    REST = "rest"
    FORWARD = "forward"
    BACKWARD = "backward"
    ARMED_BELOW = "armed below"
    LOWEST = "lowest"
    HIGHEST = "highest"


class ReplayGuard(NamedTuple):
    """A guard of the second replay.

    Attributes
    ----------
    kind : ReplayGuardKind
    place : int
        Number of its contact; -1 if it belongs to a body.
    body : str
        Body of its contacts that slide or stick together; empty if it belongs to one contact.
    """

    kind: ReplayGuardKind
    place: int = -1
    body: str = ""


EXTREMA = ReplayGuardKind.ARMED_BELOW, ReplayGuardKind.LOWEST, ReplayGuardKind.HIGHEST
"""Kinds of the guards at which the gap of a contact is recorded."""


class SwingWatch:
    """The depths below the ground and heights above it of the contacts of a robot that close under a condition.

    Parameters
    ----------
    solver : ContactSolver
    """

    def __init__(self, solver: ContactSolver) -> None:
        self._solver, self._arming = solver, DenseCall(solver.robot.arming, solver.p)
        entries = enumerate(solver.robot.contacts)
        self._places = tuple(place for place, entry in entries if entry.conditional and not entry.is_stop)
        self._depth, self._rise = dict.fromkeys(self._places, 0.0), dict.fromkeys(self._places, 0.0)

    def is_armed(self, place: int, state: Array) -> bool:
        """Return whether a contact can close in a state (q, v)."""
        return self._arm(place, state) > 0

    def list_guards(self, closed: tuple[int, ...]) -> dict[ReplayGuard, Callable[[float, Array, float], float]]:
        """Return guards; they fall through zero where a gap is to be recorded, without being events."""
        guards: dict[ReplayGuard, Callable[[float, Array, float], float]] = {}
        for place in self._places:
            if place not in closed:
                rows = partial(self._onset, place), partial(self._rate, place, -1), partial(self._rate, place, 1)
                guards |= {ReplayGuard(kind, place): row for kind, row in zip(EXTREMA, rows, strict=True)}
        return guards

    def record(self, closed: tuple[int, ...], state: Array) -> None:
        """Record the gaps of the contacts that are not closed in a state (q, v)."""
        for place in self._places:
            gap = self._gap(place, state)
            if place in closed:
                self._depth[place] = self._rise[place] = 0.0
            elif gap < -LEAST and self.is_armed(place, state):
                self._depth[place], self._rise[place] = max(self._depth[place], -gap), 0.0
            else:
                self._rise[place] = max(self._rise[place], gap)

    def find_touchdown_from_below(self, landing: int | None, *, last: bool) -> int | None:
        """Return the contact that lands from a height below its earlier depth, or is below at the end; None without."""
        for place in self._places:
            depth, rise = self._depth[place], self._rise[place]
            if depth and ((place == landing and rise <= depth) or (place != landing and last and rise <= 0)):
                return place
        return None

    def _gap(self, place: int, state: Array) -> float:
        return float(self._solver.gaps(state[: self._solver.n])[0][place])

    def _arm(self, place: int, state: Array) -> float:
        return float(self._arming(state[: self._solver.n], state[self._solver.n :])[0][place])

    def _onset(self, place: int, t: float, y: Array, middle: float) -> float:
        """Return a value that becomes negative where a contact is below the ground and armed."""
        return max(self._gap(place, y) + LEAST, -self._arm(place, y))

    def _rate(self, place: int, sign: int, t: float, y: Array, middle: float) -> float:
        """Return the rate of a gap times a sign, which falls through zero at its maxima or minima."""
        q, v = y[: self._solver.n], y[self._solver.n :]
        return sign * float(self._solver.rows(q, v)[0][place] @ v)
