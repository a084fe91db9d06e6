"""The torque of a phase of a planar robot's simulation, and the source that provides it from phase to phase."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array


class LawState(NamedTuple):
    """Memory of a law between events.

    Attributes
    ----------
    part : int
        Number of impacts since the section.
    begin : float [s]
        Time of the section.
    latched : tuple of float
        Values latched there.
    mirrored : bool
        Whether the legs have been exchanged an odd number of times.
    """

    part: int
    begin: float
    latched: tuple[float, ...]
    mirrored: bool


class TorqueSlope(NamedTuple):
    """Derivatives of a torque with respect to state, (n_u, 2 n_q), time, (n_u,), and latched values, (n_u, n_l)."""

    by_state: Array
    by_time: Array
    by_latched: Array


class PhaseTorque(ABC):
    """The torque of a phase: that between two events.

    Attributes
    ----------
    latched : tuple of float
        Latched values.
    """

    latched: tuple[float, ...] = ()

    @property
    def formula(self) -> ca.Function | None:
        """The torque within its limits as an expression (t, q, v, latched, data) -> u; None if it is not one."""
        return None

    @property
    def limits(self) -> Array | None:
        """Limits of the formula, shape (n_u,) [N m or N]; None if it has none."""
        return None

    @property
    def data(self) -> Array:
        """Data of the formula, of the piece that is held."""
        return np.zeros(0)

    @abstractmethod
    def value(self, t: float, q: Array, v: Array) -> Array:
        """Return the torque, shape (n_u,); the array may be overwritten by the next call."""

    @abstractmethod
    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        """Return the derivatives of the torque."""

    def next_corner(self, t: float) -> float:
        """Return the next time at which the integration restarts [s]."""
        return np.inf

    def hold_piece(self, span: tuple[float, float] | None) -> None:  # noqa: B027 - a torque may have no pieces
        """Use the piece of a time span until the next call; with None, that of the time of each evaluation.

        The piece of a phase variable is held by `hold_number` instead.
        """

    def find_piece(self, q: Array, v: Array) -> int | None:
        """Return the number of the piece of a phase variable in a state; None if the time determines the piece."""
        return None

    def hold_number(self, piece: int) -> None:  # noqa: B027 - a torque may have no phase variable
        """Use a piece of a phase variable until `hold_piece(None)` is called."""

    def distance(self, q: Array, v: Array) -> tuple[float, float]:
        """Return the distances of the phase variable from the lower and the upper bound of the piece that is held."""
        return np.inf, np.inf

    def phase_slope(self, q: Array, v: Array) -> Array:
        """Return the derivative of the phase variable with respect to (q, v), shape (2 n_q,)."""
        return np.zeros(2 * len(q))


class TorqueSource(ABC):
    """The torque of a simulation, with the memory that changes at events.

    Attributes
    ----------
    n_latched : int
        Number of latched values.
    """

    n_latched: int = 0

    @abstractmethod
    def start(self, time: float, q: Array, v: Array) -> LawState | None:
        """Return the memory at the beginning of a period."""

    @abstractmethod
    def pass_impact(
        self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array
    ) -> LawState | None:
        """Return the memory after an impact of some closing contacts, from the state after it."""

    def pass_event(self, memory: LawState | None, names: Iterable[str]) -> LawState | None:
        """Return the memory after an event with some changes, such as ``"foot opens"``."""
        return memory

    @abstractmethod
    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        """Return the torque until the next event."""

    def impulses(self, memory: LawState | None, closing: Iterable[str]) -> EventImpulses | None:
        """Return the impulses of the actuators at an impact of some closing contacts, from the memory before it."""
        return None

    def latched_slope(self, q: Array, v: Array) -> Array:
        """Return the derivative of the latched values at a section with respect to the state (q, v), (n_l, 2 n_q)."""
        return np.zeros((0, 2 * len(q)))
