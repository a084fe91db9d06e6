"""The hybrid automaton: one step of a walk, from a state after touchdown to the next touchdown."""

import itertools
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from gaitopt.control.law import Law
from gaitopt.model.contacts.event import EventKind, HybridEvent
from gaitopt.model.contacts.impact import Impact, TouchdownMap
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import ClosedLoop, torque_of
from gaitopt.simulation.contact_choice import REST_SPEED, ContactChoice
from gaitopt.simulation.engine import Arc, Engine, join_arcs
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.law_memory import LawMemory
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.status import Stop

STOPS = {
    EventKind.LIFT_OFF: Stop.LIFT_OFF,
    EventKind.FALL: Stop.FELL,
    EventKind.PAINLEVE: Stop.PAINLEVE,
    EventKind.SINGULAR: Stop.SINGULAR,
}
"""Events that end a walk, and the reason reported."""
_TOUCHDOWN, _PAINLEVE, _LAW_EVENT = EventKind.TOUCHDOWN, EventKind.PAINLEVE, EventKind.LAW_EVENT
Flow = Callable[[Mode, float, Array, float, bool], Arc]
"""(mode, clock, y, until, record) -> arc, as :meth:`Engine.flow` for one closed loop."""


class WalkStep(NamedTuple):
    """One step: its arcs, and the touchdown that ended it or the reason why no touchdown occurred.

    Attributes
    ----------
    arcs : tuple of (Mode, Arc)
        An event of the law also ends an arc, so consecutive arcs may have the same mode.
    stop : Stop or None
        None if the step ended with a touchdown.
    impact : Impact or None
    following : (2 n_q,) array or None
        State after the leg exchange, (q, v).
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
    def phases(self) -> tuple[tuple[Mode, Arc], ...]:
        """Arcs between changes of the contact mode; arcs on both sides of an event of the law are joined."""
        if not any(_ends_by_law_event(arc) for _, arc in self.arcs[:-1]):
            return self.arcs
        numbers = [0]
        for (mode, arc), (following, _) in itertools.pairwise(self.arcs):
            numbers.append(numbers[-1] + (following is not mode or not _ends_by_law_event(arc)))
        groups = itertools.groupby(zip(numbers, self.arcs, strict=True), key=lambda pair: pair[0])
        parts = [[arc for _, arc in group] for _, group in groups]
        return tuple((part[0][0], join_arcs([arc for _, arc in part])) for part in parts)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Contact modes in order."""
        return tuple(mode for mode, _ in self.phases)


class _ModeChange(NamedTuple):
    """A change of the contact mode at an event.

    Attributes
    ----------
    following : Mode or None
        The next mode; None if friction decides.
    zeros : list of int
        Entries of the state that become zero.
    reset : (n_y, n_y) array or None
        Derivative of the reset, if it is not a projection on the other entries.
    """

    following: Mode | None
    zeros: list[int]
    reset: Array | None


def _ends_by_law_event(arc: Arc) -> bool:
    return arc.event is not None and arc.event.kind is EventKind.LAW_EVENT


class Walker:
    """A robot with given parameters under a law, which takes steps.

    Parameters
    ----------
    robot : Robot
    law : Law
    p : (n_p,) array
    engine : Engine
    step_limits : StepLimits, optional
        Maximum duration and number of contact events of one step.
    landing : (n_p,) array, optional
        Parameters of the ground on which the swing foot lands, if it differs from that of the stance foot.
    """

    def __init__(
        self,
        robot: Robot,
        law: Law,
        p: Array,
        engine: Engine,
        *,
        step_limits: StepLimits | None = None,
        landing: Array | None = None,
    ) -> None:
        self.robot, self.law, self.p, self.engine = robot, law, p, engine
        self.step_limits = step_limits or StepLimits()
        self.loop = ClosedLoop(robot, law, p)
        self.contact, self.memory = ContactChoice(self.loop), LawMemory(law)
        self._torque: dict[Mode, FastCall] = {}
        self._landing, self._slip_velocity = (
            TouchdownMap(robot, p if landing is None else landing),
            robot.state_entries.slip_velocity,
        )
        self._transitions: dict[tuple[Mode, HybridEvent], _ModeChange] = {}

    def torque(self, mode: Mode, clock: float, y: Array) -> Array:
        """Return the torque in a contact mode at a clock time and state y, shape (n_u,) [N m]."""
        if mode not in self._torque:
            self._torque[mode] = FastCall(torque_of(self.law.torque, mode))
        return self._torque[mode](clock, y, self.loop.data(clock, y))[0]

    def torques(self, mode: Mode, times: Array, states: Array) -> Array:
        """Return the torques at clock times (K,) and states (n_y, K), shape (n_u, K) [N m]."""
        data = np.column_stack([self.loop.data(t, y) for t, y in zip(times, states.T, strict=True)])
        return np.asarray(torque_of(self.law.torque, mode)(times[None], states, data))

    def begin(self, state: Array) -> Array:
        """Return the state y at the start of a step: (q, v), followed by the latched values of the law."""
        return self.memory.begin(state)

    def walk_step(self, state: Array, *, record: bool = False, flow: Flow | None = None) -> WalkStep:
        """Simulate one step.

        Parameters
        ----------
        state : (2 n_q,) array
            (q, v) after a touchdown and leg exchange.
        record : bool
            Whether arcs are sampled for plots and energy ledgers.
        flow : callable, optional
            Integrates a contact mode instead of the engine, for example with delayed sensor readings.

        Raises
        ------
        InputError
            If the foot slides despite infinite friction, or the law has too many events at one instant.
        """
        clock, choose, until = 0.0, self.contact.choose, self.step_limits.duration
        integrate, loop, state = self.engine.flow, self.loop, self.memory.begin(state)
        if abs(state[self._slip_velocity]) <= REST_SPEED:
            state[self._slip_velocity] = 0.0
        mode = choose(clock, state)
        arcs: list[tuple[Mode, Arc]] = []
        for _ in range(self.step_limits.events):
            if flow is None:
                arc = integrate(loop, mode, clock, state, until=until, record=record)
            else:
                arc = flow(mode, clock, state, until, record)
            arcs.append((mode, arc))
            event, began, clock, state = arc.event, clock, arc.time.item(-1), arc.states[:, -1].copy()
            if event is None:
                return WalkStep(tuple(arcs), Stop.NO_TOUCHDOWN, None, None)
            kind = event.kind
            if kind is _TOUCHDOWN:
                impact, following = self._landing.solve(state[: 2 * self.robot.n_q])
                return WalkStep(tuple(arcs), None if following is not None else Stop.DOUBLE_SUPPORT, impact, following)
            if kind in STOPS:
                if kind is _PAINLEVE and clock == began:
                    arcs.pop()  # the mode has no duration
                return WalkStep(tuple(arcs), STOPS[kind], None, None)
            if kind is _LAW_EVENT:
                state = self.memory.apply_event(event.number, clock, state)
                mode = choose(clock, state)
                continue
            transition = self._transitions.get((mode, event)) or self._transition(mode, event, state.size)
            for entry in transition.zeros:
                state[entry] = 0.0
            if transition.reset is not None:
                state = transition.reset @ state
            mode = transition.following or choose(clock, state, leaving=mode)
        return WalkStep(tuple(arcs), Stop.TOO_MANY_EVENTS, None, None)

    def _transition(self, mode: Mode, event: HybridEvent, size: int) -> "_ModeChange":
        """Return the change of a mode at an event; it is stored for later steps."""
        transition = self.robot.contact_model.at(mode, event)
        reset = transition.reset(self._slip_velocity, size)
        kept = np.diag(reset)
        projects = np.array_equal(reset, np.diag(kept)) and np.all((kept == 0) | (kept == 1))
        zeros = np.flatnonzero(kept == 0).tolist() if projects else []
        change = _ModeChange(transition.following(mode), zeros, None if projects else reset)
        self._transitions[mode, event] = change
        return change


def make_walker(
    robot: Robot,
    law: Law,
    parameters: Mapping[str, float],
    *,
    period: float | None = None,
    engine: Engine | None = None,
) -> Walker:
    """Return the walker of a robot under a law, with the fastest engine that supports the law.

    Parameters
    ----------
    robot : Robot
    law : Law
    parameters : mapping of str to float
        All parameters of the robot and of the ground, such as those of a motion or of a cycle.
    period : float, optional [s]
        Period of the gait near which the robot walks: a step without a touchdown after three periods ends the walk.
    engine : Engine, optional

    Examples
    --------
    >>> from gaitopt import feedforward, compass_biped, load
    >>> gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    >>> law = feedforward(robot, gait.motion)
    >>> make_walker(robot, law, gait.motion.parameters, period=gait.period).law.name
    'feedforward'
    """
    limits = None if period is None else StepLimits(duration=3 * period)
    return Walker(robot, law, robot.vector(parameters), engine or default_engine(law, robot), step_limits=limits)
