"""State of a planar robot between events, and a smooth phase of its motion."""

from typing import NamedTuple

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import GuardKind
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.phase_torque import LawState


@dataclass(frozen=True, eq=False)
class PlanarState:
    """State of a planar robot between events.

    Attributes
    ----------
    time : float [s]
    q, v : (n_q,) arrays
    contacts : ContactState
    extended : tuple of bool
        Whether each switched spring is extended.
    memory : LawState or None
        Memory of the law of the torques; None for a torque without memory.
    pieces : tuple of int or None
        Number of the piece of the terrain under each closed contact, None for others; empty without a terrain.
    """

    time: float
    q: Array
    v: Array
    contacts: ContactState
    extended: tuple[bool, ...] = ()
    memory: LawState | None = None
    pieces: tuple[int | None, ...] = ()

    @property
    def y(self) -> Array:
        """Coordinates and rates, shape (2 n_q,)."""
        return np.concatenate([self.q, self.v])

    @property
    def modes(self) -> list[Mode]:
        """Mode of each contact."""
        return [mode for _, mode in self.contacts.modes]

    @property
    def closed(self) -> list[int]:
        """Numbers of the closed contacts."""
        return [i for i, mode in enumerate(self.modes) if mode is not Mode.FREE]

    @property
    def latched(self) -> frozenset[int]:
        """Numbers of the latched stops."""
        return frozenset(i for i, mode in enumerate(self.modes) if mode is Mode.LATCHED)


class PlanarArc(NamedTuple):
    """A smooth phase: samples, and the guard that ended it.

    Attributes
    ----------
    start : PlanarState
    time : (K,) array [s]
    states : (n_y, K) array
        (q, v, works since the start).
    ended_by : GuardKind or None
        None at the time limit.
    failed : bool
        Whether the integrator could not continue.
    law_pieces : tuple of (int, int)
        Number of the sample from which a piece of the law's phase variable acts, and that of the piece; empty without a
        phase variable.
    """

    start: PlanarState
    time: Array
    states: Array
    ended_by: GuardKind | None
    failed: bool = False
    law_pieces: tuple[tuple[int, int], ...] = ()
