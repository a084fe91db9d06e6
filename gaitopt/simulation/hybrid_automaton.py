"""The hybrid automaton: one step of a walk, from a state after touchdown to the next touchdown."""

from typing import NamedTuple

import numpy as np

from gaitopt.control.law import Law
from gaitopt.model.contacts.impact import Impact, TouchdownMap
from gaitopt.model.contacts.mode import PHYSICAL, Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import demand_of
from gaitopt.simulation.contact_choice import REST, ContactChoice
from gaitopt.simulation.engine import Arc, Engine
from gaitopt.status import Stop

STOPS = {
    "lift-off": Stop.LIFT_OFF,
    "fall": Stop.FELL,
    "painleve": Stop.PAINLEVE,
    "singular": Stop.SINGULAR,
    None: Stop.NO_TOUCHDOWN,
}
"""Reasons for which an arc ends a walk."""
SLIDES = {mode.value: mode for mode in PHYSICAL if mode.slips}


class Stride(NamedTuple):
    """One step: its arcs, and the touchdown that ended it or the reason why none did.

    Attributes
    ----------
    arcs : tuple of (Mode, Arc)
    stop : Stop or None
        None when the step ended in a touchdown.
    impact : Impact or None
    following : (2 n_q,) array or None
        State after the leg swap, (q, v).
    """

    arcs: tuple[tuple[Mode, Arc], ...]
    stop: Stop | None
    impact: Impact | None
    following: Array | None

    @property
    def duration(self) -> float:
        """Time until the touchdown or the stop [s]."""
        return float(self.arcs[-1][1].time[-1]) if self.arcs else 0.0

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Contact modes in order."""
        return tuple(mode for mode, _ in self.arcs)


class Walker:
    """A robot under a law with given parameters, ready to take steps.

    Parameters
    ----------
    robot : Robot
    law : Law
    p : (n_p,) array
    engine : Engine
    step_time_limit : float [s]
    most_events : int
        Contact events allowed in one step.
    """

    def __init__(
        self, robot: Robot, law: Law, p: Array, engine: Engine, *, step_time_limit: float = 10.0, most_events: int = 50
    ) -> None:
        self.robot, self.law, self.p, self.engine = robot, law, p, engine
        self.step_time_limit, self.most_events = step_time_limit, most_events
        self.contact = ContactChoice(robot, law, p)
        self._torque: dict[Mode, FastCall] = {mode: FastCall(demand_of(law.torque, mode)) for mode in PHYSICAL}
        self._hold = None if law.hold is None else FastCall(law.hold, law.table[:, 0])
        self._landing = TouchdownMap(robot, p)

    def torque(self, mode: Mode, clock: float, y: Array) -> Array:
        """Return the torque in a contact mode at a clock time and state y, shape (n_u,) [N m]."""
        piece = self.law.piece(self.law.measure(clock, y))
        return self._torque[mode](clock, y, self.law.table[:, piece])[0]

    def begin(self, state: Array) -> Array:
        """Return the state y at the start of a step: (q, v), followed by what the law holds over it."""
        if self._hold is None:
            return np.array(state, dtype=float)
        n = self.robot.n_q
        return np.concatenate((state, self._hold(state[:n], state[n:])[0]))

    def stride(self, state: Array, *, record: bool = False) -> Stride:
        """Walk one step.

        Parameters
        ----------
        state : (2 n_q,) array
            (q, v) after a touchdown and leg swap.
        record : bool
            Whether arcs are sampled for plots and ledgers.

        Raises
        ------
        InputError
            If the foot slides despite infinite friction.
        """
        n, clock, choose = self.robot.n_q, 0.0, self.contact.choose
        state = self.begin(state)
        if abs(state[n]) <= REST:
            state[n] = 0.0
        mode = choose(clock, state)
        arcs: list[tuple[Mode, Arc]] = []
        for _ in range(self.most_events):
            arc = self.engine.flow(
                self.robot, self.law, mode, clock, state, self.p, until=self.step_time_limit, record=record
            )
            arcs.append((mode, arc))
            event, began, clock, state = arc.event, clock, arc.time.item(-1), arc.states[:, -1].copy()
            if event == "touchdown":
                impact, following = self._landing.solve(state[: 2 * n])
                return Stride(tuple(arcs), None if following is not None else Stop.DOUBLE_SUPPORT, impact, following)
            if event == "at rest":
                state[n] = 0.0
                mode = choose(clock, state, leaving=mode)
            elif event in SLIDES:
                mode = SLIDES[event]
            else:
                if event == "painleve" and clock == began:
                    arcs.pop()  # not even begun
                return Stride(tuple(arcs), STOPS[event], None, None)
        return Stride(tuple(arcs), Stop.TOO_MANY_EVENTS, None, None)
