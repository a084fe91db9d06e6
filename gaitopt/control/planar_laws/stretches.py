"""Stretches of a planned period that share a phase variable: phases with one stance contact, and flights."""

from collections.abc import Sequence
from typing import NamedTuple

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent, PlanarSegment
from gaitopt.motion.stated_changes import CLOSES, find_closing


class Stretch(NamedTuple):
    """Consecutive phases of a planned period between two impacts that share a phase variable.

    Attributes
    ----------
    part : int
        Number of impacts since the section.
    phases : tuple of int
        Numbers of the phases.
    span : (float, float) [s]
        Planned times of its start and its end.
    contact : str or None
        Stance contact; None in flight.
    ending : str or None
        Event without impact that ends the stretch; None if an impact ends it.
    """

    part: int
    phases: tuple[int, ...]
    span: tuple[float, float]
    contact: str | None
    ending: str | None


def find_stretches(gait: PlanarGait, *, shared: bool = False) -> tuple[Stretch, ...]:
    """Return the stretches of a gait; with `shared`, phases with different stance contacts belong to one stretch.

    The stance contact of a stretch is the one that stays on the ground for the largest number of phases.

    Examples
    --------
    >>> find_stretches.__name__
    'find_stretches'
    """
    segments, events = gait.motion.segments, gait.motion.events
    impacts = [number for number, event in enumerate(events) if event.is_impact]
    closed = [_list_feet(gait.robot, segment) for segment in segments]
    stretches, first = list[Stretch](), 0
    for part, last in enumerate(dict.fromkeys([*impacts, len(segments) - 1])):
        while first <= last:
            contact, end = choose_stance_contact(closed[: last + 1], first, shared=shared)
            ending = None if end == last else _name_ending(contact, events[end])
            span = float(segments[first].time[0]), float(segments[end].time[-1])
            stretches.append(Stretch(part, tuple(range(first, end + 1)), span, contact, ending))
            first = end + 1
    return tuple(stretches)


def _list_feet(robot: PlanarRobot, segment: PlanarSegment) -> tuple[str, ...]:
    """Return the closed contacts of a phase without joint stops; those that stick come first."""
    stops = {contact.name for contact in robot.contacts if contact.is_stop}
    feet = [(name, mode) for name, mode in segment.state.modes if name not in stops and mode is not Mode.FREE]
    return tuple(name for name, _ in sorted(feet, key=lambda foot: foot[1] is not Mode.STICK))


def choose_stance_contact(closed: Sequence[tuple[str, ...]], first: int, *, shared: bool) -> tuple[str | None, int]:
    """Return the stance contact from a phase on, None in flight, and the last phase of its stretch.

    Parameters
    ----------
    closed : sequence of tuple of str
        Closed contacts of each phase, in the order of preference.
    first : int
    shared : bool
        As in :func:`find_stretches`.

    Examples
    --------
    >>> choose_stance_contact([("heel", "toe"), ("toe",), ()], 0, shared=False)
    ('toe', 1)
    """
    if not closed[first]:
        return None, _end_of_run([not feet for feet in closed], first)
    if shared:
        end = _end_of_run([bool(feet) for feet in closed], first)
        return closed[end][0], end
    ends = {name: _end_of_run([name in feet for feet in closed], first) for name in closed[first]}
    contact = max(ends, key=lambda name: ends[name])
    return contact, ends[contact]


def _end_of_run(holds: Sequence[bool], first: int) -> int:
    """Return the last of the consecutive phases from the first one on in which something holds."""
    end = first
    while end + 1 < len(holds) and holds[end + 1]:
        end += 1
    return end


def _name_ending(contact: str | None, event: PlanarEvent) -> str:
    """Return the event that ends a stretch: its contact opens, or a foot closes without impact after a flight."""
    if contact is not None:
        return f"{contact} opens"
    return f"{find_closing(event.names)[0]} {CLOSES}"
