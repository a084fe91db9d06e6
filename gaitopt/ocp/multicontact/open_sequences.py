"""Contact sequences of robots with several contacts that leave modes open: the closed sequences they stand for."""

import itertools
from collections.abc import Iterator
from dataclasses import replace

from gaitopt.errors import InputError, SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.phase_sequence import Modes, PhaseEvent, PhaseSequence
from gaitopt.ocp.multicontact.planar_enumeration import enumerate_planar_sequences
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

MOST_SEQUENCES = 60
"""Largest number of closed sequences that an open one may stand for."""

PHASES = 2
"""Largest number of phases of the sequences that ``any`` alone stands for."""

_MODES = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)


def close_sequence(sequence: PhaseSequence, robot: PlanarRobot) -> tuple[PhaseSequence, ...]:
    """Return the closed contact sequences that a sequence stands for, itself if it is closed.

    ``CONTACT any`` is a contact that sticks or slips in either direction; ``any`` alone is every sequence of at most
    two phases.  Contacts of one body have the same mode.

    Parameters
    ----------
    sequence : PhaseSequence
    robot : PlanarRobot

    Raises
    ------
    SequenceError
        If it stands for no possible sequence, or for more than 60.

    Examples
    --------
    >>> from gaitopt.model import monopod
    >>> [str(each) for each in close_sequence(PhaseSequence.parse("foot any > flight |"), monopod())]
    ['foot stick > flight |', 'foot slip+ > flight |', 'foot slip- > flight |']
    """
    if not sequence.is_open:
        return (sequence,)
    closed = list(_expand(sequence, robot) if sequence.phases else enumerate_planar_sequences(robot, PHASES))
    if not closed:
        raise SequenceError(f"The open sequence '{sequence}' matches no possible contact sequence of {robot.name!r}.")
    if len(closed) > MOST_SEQUENCES:
        raise SequenceError(
            f"The open sequence '{sequence}' matches {len(closed)} contact sequences of {robot.name!r}, more than "
            f"{MOST_SEQUENCES}: specify more modes, or list the sequences in search(problem, sequences=[...])."
        )
    return tuple(closed)


def close_problem(problem: PlanarProblem) -> list[PlanarProblem]:
    """Return the problems with the sequences that an open one stands for, without those that are invalid.

    Parameters
    ----------
    problem : PlanarProblem

    Raises
    ------
    InputError
        If none of them is valid.
    """
    closed, error = list[PlanarProblem](), None
    for sequence in close_sequence(problem.sequence, problem.robot):
        try:
            closed.append(problem.replace(sequence=sequence))
        except InputError as invalid:
            error = invalid
    if not closed and error is not None:
        raise error
    return closed


def _expand(sequence: PhaseSequence, robot: PlanarRobot) -> Iterator[PhaseSequence]:
    """Yield the possible sequences with every combination of modes in place of the open ones, each once."""
    known = set[PhaseSequence]()
    outcomes = [event.outcome for event in sequence.events]
    choices = [list(_choose(modes, robot)) for modes in sequence.phases]
    landings = [[None] if modes is None else list(_choose(modes, robot)) for modes in outcomes]
    for phases in itertools.product(*choices):
        for landing in itertools.product(*landings):
            events = tuple(replace(event, outcome=out) for event, out in zip(sequence.events, landing, strict=True))
            try:
                closed = _simplify(PhaseSequence(phases, events).check(robot), robot)
            except SequenceError:
                continue
            if closed not in known:
                known.add(closed)
                yield closed


def _choose(modes: Modes, robot: PlanarRobot) -> Iterator[Modes]:
    """Yield the combinations of modes of some closed contacts; those of one body slip together."""
    bodies = {name: robot.contacts[robot.contact_index(name)].body for name, _ in modes}
    for chosen in itertools.product(*(_MODES if mode is Mode.ANY else (mode,) for _, mode in modes)):
        shared = dict[str, Mode]()
        pairs = [(name, mode) for (name, _), mode in zip(modes, chosen, strict=True)]
        if all(shared.setdefault(bodies[name], mode) is mode for name, mode in pairs if mode in _MODES):
            yield tuple(pairs)


def _simplify(sequence: PhaseSequence, robot: PlanarRobot) -> PhaseSequence:
    """Return a sequence without the outcomes that it has by default."""
    events = list(sequence.events)
    for number, event in enumerate(events):
        plain = PhaseSequence(sequence.phases, (*events[:number], PhaseEvent(event.impact), *events[number + 1 :]))
        if event.impact and plain.outcome(robot, number) == sequence.outcome(robot, number):
            events[number] = PhaseEvent(True)
    return PhaseSequence(sequence.phases, tuple(events))
