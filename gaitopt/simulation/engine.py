"""Arcs of a simulated motion, and the protocol of the engines that integrate them."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from gaitopt.model.contacts.event import HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import ClosedLoop


class Arc(NamedTuple):
    """A smooth part of a simulated motion in one contact mode.

    Attributes
    ----------
    time : (K,) array [s]
        Clock since the start of the step; only the two ends unless the arc was recorded.
    states : (n_y, K) array
        y = (q, v, latched values of the law).
    event : HybridEvent or None
        Event that ended the arc, `SINGULAR` if the integrator could not continue; None at the time limit.
    energy : (n_works, K) array or None [J]
        Work of each actuator, friction loss and, of a robot with dampers, damping loss since the beginning of the arc;
        None unless recorded.
    """

    time: Array
    states: Array
    event: HybridEvent | None
    energy: Array | None = None


class Engine(Protocol):
    """An integrator with event location.

    Engines agree to 1e-9; the choice affects speed, not results.
    """

    name: str

    def flow(
        self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float, record: bool = False
    ) -> Arc:
        """Integrate one contact mode until a guard falls through zero, or the clock reaches `until`.

        The engine switches between the pieces of the law; an event of the law ends the arc, and the caller resets the
        latched values.

        Parameters
        ----------
        loop : ClosedLoop
        mode : Mode
        clock : float [s]
            Time since the start of the step.
        state : (n_y,) array
            y = (q, v, latched values of the law).
        until : float [s]
        record : bool
            Whether to sample the motion and integrate its energies, for plots and energy ledgers.
        """
        ...

    def sensitivity(self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float) -> Array:
        """Return d y(until) / d y(clock) at fixed times, shape (n_y, n_y), without event detection.

        Entries are nan if the integrator cannot continue to `until`.
        """
        ...


def join_arcs(arcs: Sequence[Arc]) -> Arc:
    """Return consecutive arcs as one arc, with cumulative energies."""
    if len(arcs) == 1:
        return arcs[0]
    time = np.concatenate([arc.time if k == 0 else arc.time[1:] for k, arc in enumerate(arcs)])
    states = np.hstack([arc.states if k == 0 else arc.states[:, 1:] for k, arc in enumerate(arcs)])
    if arcs[0].energy is None:
        return Arc(time[[0, -1]], states[:, [0, -1]], arcs[-1].event)
    energy = [arcs[0].energy]
    for arc in arcs[1:]:
        if arc.energy is None:
            raise ValueError("either all or none of the arcs to be joined must be recorded")
        energy.append(energy[-1][:, -1:] + arc.energy[:, 1:])
    return Arc(time, states, arcs[-1].event, np.hstack(energy))
