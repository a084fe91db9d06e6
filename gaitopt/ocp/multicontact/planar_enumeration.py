"""Enumeration of the contact sequences of a robot with several contacts."""

import itertools
from collections.abc import Iterator

from gaitopt.errors import InputError, SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.phase_sequence import Modes, PhaseEvent, PhaseSequence
from gaitopt.ocp.transcription.method import check_count

MOST_SEQUENCES = 2000
"""Largest number of sequences: those of a walker with heels and toes of at most three phases are 48,922, whose
enumeration takes minutes and whose solves would take weeks."""

_FEET = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.FREE)
_GUIDED = (Mode.CLOSED, Mode.FREE)


def enumerate_planar_sequences(robot: PlanarRobot, phases: int) -> tuple[PhaseSequence, ...]:
    """Return the contact sequences of a robot with at most `phases` phases, shorter ones first.

    A period ends with an impact.  Every contact may change at every event; contacts close with an impulse.  Sequences
    that differ by the phase with which they begin, or by an exchange of the legs, count once.  States whose contacts
    leave the robot no motion are left out.

    Parameters
    ----------
    robot : PlanarRobot
        Robot without joint stops.
    phases : int

    Raises
    ------
    InputError
        If the robot has joint stops, `phases` is not a whole number from 1 to 3, or there are more than
        `MOST_SEQUENCES` sequences.

    Examples
    --------
    >>> from gaitopt.model import monopod
    >>> [str(sequence) for sequence in enumerate_planar_sequences(monopod(), 2)]
    ['foot stick > flight |', 'foot slip+ > flight |', 'foot slip- > flight |']
    """
    check_count("max_phases", phases, 1, 3)
    if any(contact.kind == "stop" for contact in robot.contacts):
        raise InputError(
            f"The contact sequences of robot {robot.name!r} with joint stops are not enumerated; name them with "
            "sequences=[...]."
        )
    states, known, sequences = list(_states(robot)), set[tuple[Modes, ...]](), list[PhaseSequence]()
    for count in range(1, phases + 1):
        shorter = len(sequences)
        for choice in itertools.product(states, repeat=count):
            sequence = _sequence_of(robot, choice)
            if sequence is None or known & (variants := set(_variants(robot, choice))):
                continue
            known |= variants
            sequences.append(sequence)
            if len(sequences) > MOST_SEQUENCES:
                raise InputError(_describe_excess(robot, count, shorter))
    return tuple(sequences)


def _describe_excess(robot: PlanarRobot, phases: int, shorter: int) -> str:
    """Return that a robot has too many sequences of some number of phases, and how many shorter ones it has."""
    text = f"Robot {robot.name!r} has more than {MOST_SEQUENCES} contact sequences of at most {phases} phases"
    named = "name the sequences to solve in search(problem, sequences=[...])"
    if not shorter:
        return f"{text}: {named}."
    fewer = f"use max_phases={phases - 1} (--max-phases {phases - 1})"
    return f"{text}, but {shorter} of at most {phases - 1}: {fewer}, or {named}."


def _states(robot: PlanarRobot) -> Iterator[Modes]:
    """Yield the contact states that leave the robot a motion, closed contacts only."""
    feet = [contact for contact in robot.contacts if not contact.falls]
    for modes in itertools.product(*(_FEET if foot.slides else _GUIDED for foot in feet)):
        closed = [(foot, mode) for foot, mode in zip(feet, modes, strict=True) if mode is not Mode.FREE]
        tangential = dict[str, Mode]()
        if any(tangential.setdefault(foot.body, mode) is not mode for foot, mode in closed if foot.slides):
            continue  # contacts of one body slip together
        rows = len(closed) + sum(mode is Mode.STICK for mode in tangential.values())
        if rows < robot.n_q:
            yield tuple((foot.name, mode) for foot, mode in closed)


def _sequence_of(robot: PlanarRobot, choice: tuple[Modes, ...]) -> PhaseSequence | None:
    """Return the sequence of some phases, or None if no periodic motion has them or it does not end with an impact."""
    following = [*choice[1:], _exchange(robot, choice[0])]
    if any({*before} == {*after} for before, after in zip(choice, following, strict=True)):
        return None
    pairs = zip(choice, following, strict=True)
    events = [PhaseEvent(bool({*dict(after)} - {*dict(before)})) for before, after in pairs]
    if not events[-1].impact:
        return None
    try:
        return PhaseSequence(choice, tuple(events)).check(robot)
    except SequenceError:
        return None


def _variants(robot: PlanarRobot, choice: tuple[Modes, ...]) -> Iterator[tuple[Modes, ...]]:
    """Yield the same phases from each beginning, and with exchanged legs."""
    walk = [*choice, *(_exchange(robot, modes) for modes in choice)]
    for first in range(len(walk)):
        yield tuple(walk[(first + k) % len(walk)] for k in range(len(choice)))


def _exchange(robot: PlanarRobot, modes: Modes) -> Modes:
    """Return closed contacts with exchanged legs, in the order of the robot."""
    if robot.mirror is None:
        return modes
    table = dict(modes)
    places = zip(robot.contact_names, robot.mirror.contacts, strict=True)
    exchanged = ((name, table.get(robot.contact_names[place], Mode.FREE)) for name, place in places)
    return tuple((name, mode) for name, mode in exchanged if mode is not Mode.FREE)
