"""simulate: event-driven walking, with the contact mode chosen by the exact rules after every event."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError
from gaitopt.model.impact import solve_impact
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.sampling import make_jump, make_motion, make_segment
from gaitopt.simulation.contact_choice import REST, choose_mode, wellposed
from gaitopt.simulation.scipy_engine import Arc, ScipyEngine
from gaitopt.status import Stop


@dataclass(frozen=True)
class Event:
    """An entry of the event log.

    Attributes
    ----------
    time : float [s]
        Since the start of the simulation.
    step : int
    name : str
        What happened: ``slip+``, ``slip-``, ``at rest``, ``touchdown``, or the reason of a stop.
    before, after : str
        Contact modes; `after` is ``"-"`` where the simulation ended.
    """

    time: float
    step: int
    name: str
    before: str
    after: str


@dataclass(frozen=True, eq=False)
class Rollout:
    """A simulated walk.

    Attributes
    ----------
    motion : Motion
    stop : Stop
        Why it ended.
    events : tuple of Event
    engine : str
        Which engine ran.
    """

    motion: Motion
    stop: Stop
    events: tuple[Event, ...] = field(repr=False)
    engine: str = "scipy"


def simulate(
    robot: Robot,
    q: Array,
    v: Array,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    steps: int = 1,
    step_time_limit: float = 10.0,
    most_events: int = 50,
    engine: ScipyEngine | None = None,
) -> Rollout:
    """Simulate a walk with stick-slip contact.

    Parameters
    ----------
    robot : Robot
    q, v : (n_q,) arrays
        State at the start of a step, stance foot (x, y) first [m, rad; m/s, rad/s].
    parameters : mapping of str to float
        Robot and ground parameters by name; those not named keep their defaults.
    law : Law, optional
        Passive by default.
    steps : int
    step_time_limit : float [s]
        A step without touchdown ends the simulation after this time.
    most_events : int
        Contact events allowed in one step, so that chattering ends with a named stop.
    engine : ScipyEngine, optional

    Returns
    -------
    Rollout

    Raises
    ------
    InputError
        If the state has the wrong shape, is not finite, or lets the foot leave the ground.

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt import compass_biped, simulate
    >>> angles, rates = [-0.147836890, -0.147836890], [0.732796791, -0.500667882]
    >>> walk = simulate(compass_biped(), [0, 0, *angles], [0, 0, *rates], {"slope": np.deg2rad(1), "friction": 0.3})
    >>> str(walk.motion.word()), round(walk.motion.period, 6)
    ('stick | stick', 0.744621)
    """
    engine = engine or ScipyEngine()
    law = law or passive(robot)
    values = robot.resolve(parameters)
    p = robot.vector(values)
    q, v = _checked(robot, "q", q), _checked(robot, "v", v)
    if v[1] != 0:
        raise InputError(
            f"The stance foot must not leave the ground: its normal velocity v[1] must be 0, got {v[1]:g}."
        )
    walk = _Walk(robot, law, p)
    stop = Stop.STEPS_DONE
    for step in range(steps):
        outcome = walk.step(engine, step, q, v, step_time_limit, most_events)
        if isinstance(outcome, Stop):
            stop = outcome
            break
        q, v = outcome.q_next, outcome.v_next
    motion = make_motion(robot, values, tuple(walk.segments), tuple(walk.jumps))
    return Rollout(motion, stop, tuple(walk.events), engine.name)


def _checked(robot: Robot, name: str, value: Array) -> Array:
    array = np.array(value, dtype=float)
    if array.shape != (robot.n_q,):
        raise InputError(
            f"{name} needs {robot.n_q} entries (x, y, {', '.join(robot.angles)}), got shape {array.shape}."
        )
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite, got {array.tolist()}.")
    return array


_STOPS = {"lift-off": Stop.LIFT_OFF, "fall": Stop.FELL, "painleve": Stop.PAINLEVE}


class _Walk:
    """A walk in progress: what has been recorded so far."""

    def __init__(self, robot: Robot, law: Law, p: Array) -> None:
        self.robot, self.law, self.p = robot, law, p
        self.segments: list[Segment] = []
        self.jumps: list[Jump] = []
        self.events: list[Event] = []
        self._began = 0.0

    def step(self, engine: ScipyEngine, step: int, q: Array, v: Array, limit: float, most_events: int) -> Jump | Stop:
        """Walk one step; return its touchdown, or why there was none."""
        robot, n = self.robot, self.robot.n_q
        v = np.where(np.arange(n) == 0, np.where(abs(v[0]) > REST, v[0], 0.0), v)
        mode, clock = choose_mode(robot, q, v, self._torque(0.0, q, v), self.p), 0.0
        for _ in range(most_events):
            if not wellposed(robot, mode, q, self.p):
                return self._stopped(step, clock, mode, "painleve")
            state = np.concatenate([q, v, np.zeros(robot.n_u + 1)])
            arc = engine.flow(robot, self.law, mode, clock, state, self.p, until=limit)
            self._record(step, mode, arc)
            clock, state = arc.time[-1], arc.states[:, -1]
            q, v = state[:n].copy(), state[n : 2 * n].copy()
            if arc.event is None:
                self.events.append(Event(self._began + clock, step, "time limit", mode.value, "-"))
                return Stop.NO_TOUCHDOWN
            if arc.event in _STOPS:
                return self._stopped(step, clock, mode, arc.event)
            if arc.event == "touchdown":
                return self._touchdown(step, clock, mode, q, v)
            after = self._after(arc.event, mode, clock, q, v)
            self.events.append(Event(self._began + clock, step, arc.event, mode.value, after.value))
            mode = after
        return Stop.TOO_MANY_EVENTS

    def _after(self, event: str, mode: Mode, clock: float, q: Array, v: Array) -> Mode:
        """Return the mode after a contact event; a foot that comes to rest rests exactly."""
        if event != "at rest":
            return Mode(event)
        v[0] = 0.0
        return choose_mode(self.robot, q, v, self._torque(clock, q, v), self.p, leaving=mode)

    def _touchdown(self, step: int, clock: float, mode: Mode, q: Array, v: Array) -> Jump | Stop:
        impact = solve_impact(self.robot, q, v, self.p)
        if impact.mode is None or impact.separation < 0:
            self.events.append(Event(self._began + clock, step, "double support", mode.value, "-"))
            return Stop.DOUBLE_SUPPORT
        jump = make_jump(
            self.robot,
            self.p,
            step=step,
            time=self._began + clock,
            mode=impact.mode,
            impulse=impact.impulse,
            q=q,
            v_minus=v,
            v_plus=impact.v_plus,
        )
        jump.v_next[1] = 0.0
        if not impact.mode.slips:
            jump.v_next[0] = 0.0
        self.events.append(Event(jump.time, step, "touchdown", mode.value, impact.mode.value))
        self.jumps.append(jump)
        self._began = jump.time
        return jump

    def _stopped(self, step: int, clock: float, mode: Mode, event: str) -> Stop:
        self.events.append(Event(self._began + clock, step, event, mode.value, "-"))
        return _STOPS[event]

    def _torque(self, clock: float, q: Array, v: Array) -> Array:
        data = self.law.table[:, self.law.piece(clock)]
        return np.asarray(self.law.torque(clock, q, v, data)).ravel()

    def _record(self, step: int, mode: Mode, arc: Arc) -> None:
        robot, n = self.robot, self.robot.n_q
        self.segments.append(
            make_segment(
                robot,
                self.p,
                mode=mode,
                step=step,
                time=self._began + arc.time,
                q=arc.states[:n],
                v=arc.states[n : 2 * n],
                torque=arc.torque,
                work=arc.states[2 * n : 2 * n + robot.n_u],
                friction_work=arc.states[-1],
            )
        )
