"""Arcs: what an engine returns, and what every engine can do."""

from typing import NamedTuple, Protocol

from gaitopt.control.law import Law
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array


class Arc(NamedTuple):
    """A smooth stretch of simulated motion in one contact mode.

    Attributes
    ----------
    time : (K,) array [s]
        Clock since the start of the step; only the two ends unless the arc was recorded.
    states : (n_y, K) array
        y = (q, v), followed by what the law holds over the step.
    event : str or None
        Name of the guard that ended it, or "singular" where the integrator could not go on; None at the time limit.
    energy : (n_u + 1, K) array or None [J]
        Work of each actuator and friction loss since the arc began; None unless recorded.
    """

    time: Array
    states: Array
    event: str | None
    energy: Array | None = None


class Engine(Protocol):
    """An integrator with event location.

    Engines agree to 1e-9; which one runs decides speed, not results.
    """

    name: str

    def flow(
        self,
        robot: Robot,
        law: Law,
        mode: Mode,
        clock: float,
        state: Array,
        p: Array,
        *,
        until: float,
        record: bool = False,
    ) -> Arc:
        """Integrate one contact mode until a guard falls through zero, or the clock reaches `until`.

        Parameters
        ----------
        robot : Robot
        law : Law
        mode : Mode
        clock : float [s]
            Time since the start of the step.
        state : (n_y,) array
            y = (q, v), followed by what the law holds over the step.
        p : (n_p,) array
        until : float [s]
        record : bool
            Whether to sample the motion and integrate its energies, for plots and ledgers.
        """
        ...

    def sensitivity(
        self, robot: Robot, law: Law, mode: Mode, clock: float, state: Array, p: Array, *, until: float
    ) -> Array:
        """Return d y(until) / d y(clock) at fixed times, shape (n_y, n_y), without watching guards.

        Entries are nan where the integrator cannot go on to `until`.
        """
        ...
