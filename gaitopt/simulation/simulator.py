"""simulate: event-driven simulation of walking, with the contact mode determined exactly after every event."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, passive
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.event import EventKind
from gaitopt.model.contacts.impact import Impact
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import GAP
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.sampling import SegmentSamples, make_motion, make_segment
from gaitopt.parameters import Parameter
from gaitopt.simulation.delay import DelayedWalker
from gaitopt.simulation.engine import Arc, Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.status import Stop

MOST_STEPS = 1_000_000
"""Largest number of steps of a simulation."""


@dataclass(frozen=True)
class Event:
    """An entry of the event log.

    Attributes
    ----------
    time : float [s]
        Time since the start of the simulation.
    step : int
    name : str
        ``slip+``, ``slip-``, ``at rest``, ``touchdown``, an event of the law, or the reason of a stop.
    before, after : str
        Contact modes; `after` is ``"-"`` if the simulation ends.
    impulse : (float, float) or None [N s]
        (Lambda_t, Lambda_n) of a touchdown.
    energy_lost : float [J]
        Energy lost at a touchdown.

    Examples
    --------
    >>> Event(0.7, 0, "touchdown", "stick", "slip+").after
    'slip+'
    """

    time: float
    step: int
    name: str
    before: str
    after: str
    impulse: tuple[float, float] | None = None
    energy_lost: float = 0.0


@dataclass(frozen=True, eq=False)
class Rollout:
    """A simulated walk.

    Attributes
    ----------
    motion : Motion
    stop : Stop
        Reason for which the simulation ended.
    events : tuple of Event
    engine : str
        Name of the engine used.

    Examples
    --------
    >>> from gaitopt import rimless_wheel, simulate
    >>> walk = simulate(rimless_wheel(), [0, 0, -0.314], [0, 0, 0.1], {"slope": 0.2})
    >>> walk.stop.key, len(walk.motion.jumps)
    ('fell', 0)
    """

    motion: Motion
    stop: Stop
    events: tuple[Event, ...] = field(repr=False)
    engine: str = "scipy"


@check_arguments
def simulate(
    robot: Robot,
    q: Array,
    v: Array,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    steps: int = 1,
    step_limits: StepLimits | None = None,
    engine: Engine | None = None,
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
    step_limits : StepLimits, optional
        Maximum duration and number of contact events of one step.
    engine : Engine, optional
        By default the fastest installed engine that supports the law; `Rollout.engine` names it.

    Returns
    -------
    Rollout

    Raises
    ------
    InputError
        If the state has the wrong shape, is not finite, or lets the foot leave the ground or slide despite infinite
        friction.

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt import compass_biped, simulate
    >>> angles, rates = [-0.147836890, -0.147836890], [0.732796791, -0.500667882]
    >>> walk = simulate(compass_biped(), [0, 0, *angles], [0, 0, *rates], {"slope": np.deg2rad(1), "friction": 0.3})
    >>> str(walk.motion.sequence()), round(walk.motion.period, 6)
    ('stick | stick', 0.744621)
    """
    check_robot_type(robot, Robot, "a Robot such as compass_biped()", "simulate_planar")
    Parameter("steps", 1, "1", "", lower=1, upper=MOST_STEPS, whole=True).check(steps)
    law = law or passive(robot)
    engine = engine or default_engine(law, robot)
    p = robot.vector(robot.resolve(parameters))
    q, v = _check_state(robot, "q", q), _check_state(robot, "v", v)
    if v[GAP] != 0:
        raise InputError(
            f"The stance foot must not leave the ground: its normal velocity v[1] must be 0, got {v[GAP]:g}."
        )
    walker = Walker(robot, law, p, engine, step_limits=step_limits)
    return record_walk(walker, np.concatenate([q, v]), steps)


def record_walk(walker: Walker | DelayedWalker, state: Array, steps: int) -> Rollout:
    """Simulate a walk from a state (q, v), shape (2 n_q,), and record motion and events."""
    segments: list[Segment] = []
    jumps: list[Jump] = []
    events: list[Event] = []
    start_time, stop = 0.0, Stop.STEPS_DONE
    for step in range(steps):
        walk_step = walker.walk_step(state, record=True)
        segments += [_segment(walker, step, start_time, mode, arc) for mode, arc in walk_step.phases]
        events += _events(walker.law, walk_step, step, start_time)
        start_time += walk_step.duration
        if walk_step.stop is not None or walk_step.impact is None or walk_step.following is None:
            stop = walk_step.stop or stop
            break
        jumps.append(
            _jump(walker, step, start_time, walk_step.arcs[-1][1].states[:, -1], walk_step.impact, walk_step.following)
        )
        state = walk_step.following
    names = [parameter.name for parameter in walker.robot.parameters]
    values = dict(zip(names, walker.p.tolist(), strict=True))
    motion = make_motion(walker.robot, values, tuple(segments), tuple(jumps))
    return Rollout(motion, stop, tuple(events), walker.engine.name)


def _check_state(robot: Robot, name: str, value: Array) -> Array:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} needs numbers (x, y, {', '.join(robot.angles)}), got {value!r}.") from None
    if array.shape != (robot.n_q,):
        raise InputError(
            f"{name} needs {robot.n_q} entries (x, y, {', '.join(robot.angles)}), got shape {array.shape}."
        )
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite, got {array.tolist()}.")
    return array


def _segment(walker: Walker | DelayedWalker, step: int, start_time: float, mode: Mode, arc: Arc) -> Segment:
    robot, n = walker.robot, walker.robot.n_q
    energy = np.zeros((robot.n_works, arc.time.size)) if arc.energy is None else arc.energy
    samples = SegmentSamples(
        mode=mode,
        step=step,
        time=start_time + arc.time,
        q=arc.states[:n],
        v=arc.states[n : 2 * n],
        torque=walker.torques(mode, arc.time, arc.states),
        work=energy[: robot.n_u],
        friction_work=energy[robot.n_u],
        damping_work=energy[-1] if robot.has_dampers else None,
    )
    return make_segment(robot, walker.p, samples)


def _jump(
    walker: Walker | DelayedWalker, step: int, time: float, state: Array, impact: Impact, following: Array
) -> Jump:
    n = walker.robot.n_q
    if impact.mode is None:
        raise InputError("A touchdown whose impact has no outcome cannot be recorded.")
    return Jump(
        step=step,
        time=time,
        mode=impact.mode,
        impulse=impact.impulse,
        q=state[:n],
        v_minus=state[n : 2 * n],
        v_plus=impact.v_plus,
        q_next=following[:n],
        v_next=following[n:],
        energy_lost=impact.energy_lost,
        separation=impact.separation,
    )


def _events(law: Law, walk_step: WalkStep, step: int, start_time: float) -> list[Event]:
    """Return the log of a step: every change of mode, events of the law, the touchdown, or the reason of the stop."""
    log = []
    following = [mode.value for mode, _ in walk_step.arcs[1:]]
    for (mode, arc), after in zip(walk_step.arcs, following, strict=False):
        if arc.event is None:
            continue
        by_law = arc.event.kind is EventKind.LAW_EVENT
        name = law.memory.events[arc.event.number] if by_law else arc.event.label
        log.append(Event(start_time + float(arc.time[-1]), step, name, mode.value, after))
    last = walk_step.modes[-1].value if walk_step.arcs else "-"
    end = start_time + walk_step.duration
    if walk_step.stop is None and walk_step.impact is not None and walk_step.impact.mode is not None:
        impact = walk_step.impact
        after = impact.mode.value if impact.mode else "-"
        impulse = (float(impact.impulse[0]), float(impact.impulse[1]))
        log.append(Event(end, step, "touchdown", last, after, impulse, impact.energy_lost))
    elif walk_step.stop is not None:
        log.append(Event(end, step, walk_step.stop.key.replace("_", " "), last, "-"))
    return log
