"""Changes of the piece of a law whose phase variable, not the time, determines the piece."""

import numpy as np
from scipy.optimize import brentq

from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.planar_engine import StepOutput
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase

INSTANT = 1e-11
"""Shortest time in a piece [s]."""

MAX_CHANGES = 3
"""Largest number of changes at one instant: a phase variable may turn at the bound of a piece."""


class LawPieceWatch:
    """Holds the piece of a phase's law and locates the instants at which the phase variable leaves it.

    Parameters
    ----------
    phase : PlanarPhase
    y : (n_y,) array
        State at the beginning of the phase.

    Attributes
    ----------
    exit : float [s]
        Instant at which the phase variable leaves the piece; infinite if it is not known yet.
    changes : list of (int, int)
        As `law_pieces` of :class:`PlanarArc`.
    """

    def __init__(self, phase: PlanarPhase, y: Array) -> None:
        self._phase, self._n = phase, phase.n_q
        self._piece = phase.source.find_piece(*self._split(y))
        self._step, self._last, self._count = 0, -np.inf, 0
        self.exit, self.changes = np.inf, list[tuple[int, int]]()
        if self._piece is not None:
            self.changes.append((0, self._piece))

    def hold(self, time: float, sample: int) -> None:
        """Hold the piece from a sample on, at which the integration restarts; it is another one at the exit."""
        if self._piece is None:
            return
        if self.exit <= time + INSTANT:
            self._piece += self._step
            self._count = self._count + 1 if time - self._last <= INSTANT else 1
            self.exit, self._last = np.inf, time
            self.changes.append((sample, self._piece))
        self._phase.source.hold_number(self._piece)

    def leaves(self, dense: StepOutput, instants: Array, states: Array) -> bool:
        """Return whether the phase variable leaves the piece within a step, and locate the exit."""
        if self._piece is None or np.isfinite(self.exit):
            return False
        if self._count > MAX_CHANGES and dense.t_old - self._last <= INSTANT:
            return False
        for time, y in zip(instants.tolist(), states, strict=True):
            sides = self._distance(y)
            if min(sides) >= 0:
                continue
            side = int(np.argmin(sides))
            self._step = (-1, 1)[side]
            begins_outside = self._distance(dense(dense.t_old))[side] <= 0
            self.exit = dense.t_old
            if not begins_outside:
                self.exit = self._locate(dense, side, time)
            return True
        return False

    def _locate(self, dense: StepOutput, side: int, end: float) -> float:
        """Return the instant within a step at which the phase variable leaves the piece on one side."""
        return float(brentq(lambda t: self._distance(dense(t))[side], dense.t_old, end, xtol=1e-15))

    def _distance(self, y: Array) -> tuple[float, float]:
        return self._phase.source.distance(*self._split(y))

    def _split(self, y: Array) -> tuple[Array, Array]:
        return y[: self._n], y[self._n : 2 * self._n]
