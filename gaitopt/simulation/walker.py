"""The hybrid automaton: one step of a walk, from a state after touchdown to the next touchdown."""

import functools
from bisect import bisect_right
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, held_size
from gaitopt.model.buffered import Buffered
from gaitopt.model.impact import Impact, solve_impact
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.arc import Arc, Engine
from gaitopt.simulation.closed_loop import demand_of
from gaitopt.simulation.contact_choice import REST, ContactChoice
from gaitopt.status import Stop

STOPS = {
    "lift-off": Stop.LIFT_OFF,
    "fall": Stop.FELL,
    "painleve": Stop.PAINLEVE,
    "singular": Stop.SINGULAR,
    None: Stop.NO_TOUCHDOWN,
}
"""Reasons for which an arc ends a walk."""


@dataclass(frozen=True, eq=False)
class Stride:
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
        self.contact = ContactChoice(robot, p)
        self._torque: dict[Mode, Buffered] = {mode: Buffered(demand_of(law.torque, mode)) for mode in Mode}
        self._hold = None if law.hold is None else Buffered(law.hold, law.table[:, 0])
        self._force = functools.cache(self._resting_force)
        self._breaks = law.breakpoints.tolist()
        self._here = np.zeros(1 + 2 * robot.n_q + held_size(law.torque))
        self._swap = Buffered(robot.swap, p)

    def torque(self, mode: Mode, clock: float, y: Array) -> Array:
        """Return the torque in a contact mode at a clock time and state y, shape (n_u,) [N m]."""
        return self._torque[mode](clock, y, self.law.table[:, self.law.piece(clock)])[0]

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
        n, clock = self.robot.n_q, 0.0
        state = self.begin(state)
        if abs(state[n]) <= REST:
            state[n] = 0.0
        mode = self._choose(clock, state)
        arcs: list[tuple[Mode, Arc]] = []
        for _ in range(self.most_events):
            if not self.contact.wellposed(mode, state[:n]):
                return Stride(tuple(arcs), Stop.PAINLEVE, None, None)
            arc = self.engine.flow(
                self.robot, self.law, mode, clock, state, self.p, until=self.step_time_limit, record=record
            )
            arcs.append((mode, arc))
            clock, state = float(arc.time[-1]), arc.states[:, -1].copy()
            if arc.event in STOPS:
                return Stride(tuple(arcs), STOPS[arc.event], None, None)
            if arc.event == "touchdown":
                return self._touchdown(tuple(arcs), state)
            if arc.event == "at rest":
                state[n] = 0.0
                mode = self._choose(clock, state, leaving=mode)
            else:
                mode = Mode(str(arc.event))
        return Stride(tuple(arcs), Stop.TOO_MANY_EVENTS, None, None)

    def _choose(self, clock: float, state: Array, leaving: Mode | None = None) -> Mode:
        """Return the mode in which the foot goes on."""
        speed = state[self.robot.n_q]
        if abs(speed) > REST:
            return self.contact.slide(float(speed))
        self._here[0], self._here[1:] = clock, state
        piece = max(bisect_right(self._breaks, clock) - 1, 0)  # as Law.piece, but ten times faster
        tangential, normal = self._force(piece).packed(self._here).tolist()
        return self.contact.leave_rest(tangential, normal, leaving)

    def _resting_force(self, piece: int) -> Buffered:
        """Return (clock, y) -> force that keeps the foot at rest, in one piece of the law."""
        return Buffered(_resting_force(self.robot, self.law.torque), self.p, self.law.table[:, piece])

    def _touchdown(self, arcs: tuple[tuple[Mode, Arc], ...], state: Array) -> Stride:
        n = self.robot.n_q
        impact = solve_impact(self.robot, state[:n], state[n : 2 * n], self.p)
        if impact.mode is None or impact.separation < 0:
            return Stride(arcs, Stop.DOUBLE_SUPPORT, impact, None)
        following = self._swap.packed(np.concatenate((state[:n], impact.v_plus))).copy()
        following[n + 1] = 0.0  # the landing foot stays on the ground, exactly
        if impact.mode is Mode.STICK:
            following[n] = 0.0
        return Stride(arcs, None, impact, following)


@functools.lru_cache(maxsize=128)
def _resting_force(robot: Robot, torque: ca.Function) -> ca.Function:
    """Return (clock, y, p, data) -> force that keeps a foot at rest under a law."""
    demand = demand_of(torque, Mode.STICK)
    clock, y, data = demand.sx_in()
    p, n = ca.SX.sym("p", len(robot.parameters)), robot.n_q
    _, force = robot.acceleration[Mode.STICK](y[:n], y[n : 2 * n], demand(clock, y, data), p)
    return ca.Function("resting_force", [clock, y, p, data], ca.cse([force]))
