"""simulate_planar: event-driven simulation of a planar robot with any contacts."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.lazy import Deferred
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.model.terrain import Terrain, separate_terrain
from gaitopt.motion.contact_trajectories import sample_contacts
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment
from gaitopt.parameters import Parameter
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.status import Stop

MAX_EVENTS = 10_000
"""Largest number of events of one simulation."""

DURATION = Parameter("duration", 10.0, "s", "time after which a simulation ends", lower=0.0, upper=1e5)

HAPPENINGS = ("closes", "opens", "stick", "slip+", "slip-", "released", "extends", "crosses")
"""Second part of the name of an event."""

INSTANT, MAX_SIMULTANEOUS = 1e-12, 20
"""Time [s] within which events are simultaneous, and their largest number."""

StepObserver = Callable[[int, int], None]
"""Called with (steps done, steps in all)."""


@dataclass(frozen=True, eq=False)
class PlanarRollout:
    """A simulated motion of a planar robot.

    Attributes
    ----------
    motion : PlanarMotion
    stop : Stop
        Reason for which the simulation ended.
    start, end : PlanarState
        The states at the beginning, with the modes found there, and after the last event.
    arcs : tuple of PlanarArc
        The integrated phases.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> rollout = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, duration=0.1)
    >>> rollout.stop.key, rollout.motion.segments, rollout.end.q.round(4).tolist()
    ('duration_done', (PlanarSegment(foot free, hip point free; 0 to 0.1 s),), [0.0, 0.6509, 0.0, 0.0, 0.6])
    """

    motion: PlanarMotion
    stop: Stop
    start: PlanarState | None
    end: PlanarState | None
    arcs: tuple[PlanarArc, ...]


@check_arguments
def simulate_planar(
    robot: PlanarRobot,
    q: Array,
    v: Array,
    parameters: Mapping[str, float | Terrain | None],
    *,
    duration: float = 10.0,
    until: str | None = None,
    torque: ca.Function | PlanarLaw | None = None,
    latched: tuple[str, ...] | None = None,
) -> PlanarRollout:
    """Simulate a planar robot; every contact is free, sticks or slips by itself.

    Parameters
    ----------
    robot : PlanarRobot
    q, v : (n_q,) arrays
        State at the beginning [m, rad; m/s, rad/s].  Contacts without gap and normal speed are closed.
    parameters : mapping of str to float
        Robot and ground parameters by name; those not named keep their defaults.  ``"terrain"`` may be a
        :class:`~gaitopt.model.Terrain`; a ``Ground`` with one contains it.
    duration : float [s]
        Time after which the simulation ends, at most 1e5 s.
    until : str, optional
        Event at which the simulation ends, such as ``"foot B closes"``.
    torque : Function or PlanarLaw, optional
        (t, q, v) -> u of all actuators, or a law, whose clock starts here; zero by default.
    latched : tuple of str, optional
        Stops that are latched at the beginning; see :meth:`PlanarAutomaton.begin` for the default.

    Returns
    -------
    PlanarRollout

    Raises
    ------
    InputError
        If the state has the wrong shape, is not finite, or a parameter, the duration, the event or the torque is
        invalid.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> rollout = simulate_planar(vertical_hopper(), [0.7, 0.2], [0, 0], {}, until="sole opens")
    >>> rollout.stop.key, rollout.motion.sequence
    ('event_reached', 'full length latched | sole closed > sole closed |')
    """
    check_robot_type(robot, PlanarRobot, "a PlanarRobot such as monopod()", "simulate")
    duration = DURATION.check(duration)
    check_event(robot, until)
    values, terrain = separate_terrain(parameters)
    automaton = PlanarAutomaton(robot, robot.resolve(values), torque, terrain)
    q, v = _check_state(robot, "q", q), _check_state(robot, "v", v)
    state = automaton.begin(q, v, latched=latched)
    return follow(automaton, state, duration=duration, until=until)


def check_event(robot: PlanarRobot, name: str | None) -> None:
    """Raise InputError unless an event is ``"CONTACT HAPPENS"`` with a contact of the robot, or None.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> check_event(monopod(), "foot closes")
    """
    if name is None:
        return
    contact, _, happens = name.rpartition(" ")
    if happens not in HAPPENINGS or contact not in robot.contact_names:
        raise InputError(
            f"An event must be one of {', '.join(robot.contact_names)} followed by one of {', '.join(HAPPENINGS)}, "
            f"got {name!r}."
        )


def follow(
    automaton: PlanarAutomaton,
    state: PlanarState | Stop,
    *,
    duration: float,
    until: str | None = None,
    steps: int = 1,
    most_events: int = MAX_EVENTS,
    most_samples: float = math.inf,
    observer: StepObserver | None = None,
) -> PlanarRollout:
    """Simulate a planar robot from a state with known contact modes; see :func:`simulate_planar`.

    With several steps, the event `until` ends the first step, the event of the other leg ends the second one, and so
    on.  After `most_events` events, or more than `most_samples` samples, the motion ends.  With an observer, it also
    ends at Ctrl-C, with its last event.
    """
    ends = () if until is None else list_section_events(automaton.robot, until)
    arcs: list[PlanarArc] = []
    events: list[PlanarEvent] = []
    done = 0
    start = None if isinstance(state, Stop) else state
    end, stop = start, state if isinstance(state, Stop) else Stop.TOO_MANY_EVENTS
    while end is not None and len(events) < most_events and not _chatters(events, arcs, most_samples):
        try:
            arc = automaton.flow(end, duration if start is None else start.time + duration)
            resolved = None if arc.ended_by is None else automaton.events.resolve(arc)
        except KeyboardInterrupt:
            if observer is None or not events:
                raise
            stop = Stop.INTERRUPTED
            break
        arcs.append(arc)
        if resolved is None:
            end, stop = _end_between_events(automaton, end, arc)
            break
        if isinstance(resolved, Stop):
            stop = resolved
            break
        end, event = resolved
        events.append(event)
        if ends and event.includes(ends[done % len(ends)]):
            done += 1
            if observer is not None:
                observer(done, steps)
            if done == steps:
                stop = Stop.EVENT_REACHED
                break
    return PlanarRollout(make_planar_motion(automaton, arcs, events), stop, start, end, tuple(arcs))


def list_section_events(robot: PlanarRobot, section: str) -> tuple[str, ...]:
    """Return the events that end the steps of a walk in turn: the section event and that of the other leg.

    Examples
    --------
    >>> from gaitopt.model import compass_with_two_feet
    >>> list_section_events(compass_with_two_feet(), "foot B closes")
    ('foot B closes', 'foot A closes')
    """
    contact, _, happens = section.rpartition(" ")
    if robot.mirror is None:
        return (section,)
    partner = robot.contact_names[robot.mirror.contacts[robot.contact_names.index(contact)]]
    return section, f"{partner} {happens}"


def _end_between_events(automaton: PlanarAutomaton, state: PlanarState, arc: PlanarArc) -> tuple[PlanarState, Stop]:
    """Return the state at the end of an arc that begins in a state and ends without event, and the reason."""
    n, last = automaton.robot.n_q, arc.states[:, -1]
    end = replace(state, time=float(arc.time[-1]), q=last[:n].copy(), v=last[n : 2 * n].copy())
    return end, automaton.name_failure(arc) if arc.failed else Stop.DURATION_DONE


def _chatters(events: list[PlanarEvent], arcs: list[PlanarArc], most_samples: float) -> bool:
    """Return whether too many of the last events are simultaneous, or the arcs have more than `most_samples`."""
    recent = events[-MAX_SIMULTANEOUS:]
    if sum(arc.time.size for arc in arcs) > most_samples:
        return True
    return len(recent) == MAX_SIMULTANEOUS and recent[-1].time - recent[0].time < INSTANT


def make_planar_motion(
    automaton: PlanarAutomaton, arcs: Sequence[PlanarArc], events: Sequence[PlanarEvent]
) -> PlanarMotion:
    """Return the motion of some arcs and events."""
    segments = (make_planar_segment(automaton, arc) for arc in arcs)
    return PlanarMotion.of(automaton.robot, automaton.values, segments, events, automaton.terrain)


def make_planar_segment(automaton: PlanarAutomaton, arc: PlanarArc) -> PlanarSegment:
    """Return the samples of an arc; those that the integration does not need are evaluated when they are read."""
    phase, n, n_u = automaton.phase(arc.start), automaton.robot.n_q, automaton.robot.n_u
    q, v, works = arc.states[:n], arc.states[n : 2 * n], arc.states[2 * n :]
    samples = list(zip(arc.time, arc.states.T, strict=True))

    @functools.cache
    def energies_and_points() -> tuple[Array, Array]:
        energies, points = zip(*(phase.sample(y) for _, y in samples), strict=True)
        return np.array(energies).T, np.stack(points, axis=-1)

    def torque() -> Array:
        return np.array([phase.torque(t, y).copy() for t, y in samples]).reshape(arc.time.size, n_u).T

    return PlanarSegment(
        state=arc.start.contacts,
        time=arc.time,
        q=q,
        v=v,
        torque=Deferred(torque),
        force=Deferred(lambda: np.stack([phase.forces(t, y) for t, y in samples], axis=-1)),
        work=works[:n_u],
        friction_work=works[n_u:-1],
        damping_work=works[-1],
        kinetic=Deferred(lambda: energies_and_points()[0][0]),
        potential=Deferred(lambda: energies_and_points()[0][1]),
        elastic=Deferred(lambda: energies_and_points()[0][2]),
        points=Deferred(lambda: energies_and_points()[1]),
        kinematics=Deferred(lambda: sample_contacts(automaton.robot, automaton.values, q, v)),
    )


def _check_state(robot: PlanarRobot, name: str, value: Array) -> Array:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} needs numbers ({', '.join(robot.coordinates)}), got {value!r}.") from None
    if array.shape != (robot.n_q,) or not np.all(np.isfinite(array)):
        raise InputError(
            f"{name} needs {robot.n_q} finite entries ({', '.join(robot.coordinates)}), got {array.tolist()}."
        )
    return array
