"""Contact sequences of robots with several contacts: the closed contacts of each phase, and the events between phases.

    sequence = phase event {phase event}
    phase    = "flight" | contact mode {"," contact mode}          contacts that are not named are free
    event    = (">" | "|" ["[" contact mode {"," contact mode} "]"]) ["(" change {"&" change} ")"]
    change   = contact ("closes" | "opens" | "released" | mode)

``>`` is an event without impulse: lift-off, slip onset, rest, reversal, release of a stop, soft touchdown.  ``|`` is an
impact: a touchdown, or a joint that reaches its stop.  The brackets state its outcome at every contact that receives an
impulse; without them it is that of the phase that follows.  The last event leads to the first phase again, after the
exchange of the legs.  Everything that changes between two phases changes at the same event; the parentheses may state
these simultaneous changes as results print them, and they are then checked against the phases.

``"foot stick > flight |"`` is a hop; ``"foot A slip+, foot B stick > foot B stick |"`` a walk in which the trailing
foot is dragged forward after touchdown.  The sequences of walkers with one foot on the ground, such as
``"slip+ stick | slip+"``, are read as well.

The mode ``any`` leaves open whether a contact sticks or slips; ``any`` alone leaves the whole sequence open.  Such a
sequence stands for several closed ones, which ``solve_planar`` and ``search`` solve one by one.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import SequenceError, suggest
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode, suggest_mode
from gaitopt.model.planar.contact_entry import ContactEntry
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.stated_changes import check_changes, list_changes, read_changes

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot

Modes = tuple[tuple[str, Mode], ...]
"""Closed contacts and their modes."""

FLIGHT = "flight"
_FEET = {mode.value: mode for mode in (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)}
_OPEN = {Mode.ANY.value: Mode.ANY}
_STOPS = {mode.value: mode for mode in (Mode.CLOSED, Mode.LATCHED)}
_EXAMPLE = 'Write phases and events, for example "foot stick > flight |".'


@dataclass(frozen=True)
class PhaseEvent:
    """The event at the end of a phase.

    Attributes
    ----------
    impact : bool
    outcome : tuple of (str, Mode), or None
        Contacts that receive an impulse, and their modes in the impact; None stands for those of the next phase.
    changes : tuple of str
        Changes that the text states, such as ``"foot B closes"``; none if it leaves them to the phases.
    """

    impact: bool
    outcome: Modes | None = None
    changes: tuple[str, ...] = ()

    def __str__(self) -> str:
        outcome = f" [{_text_of(self.outcome)}]" if self.outcome is not None else ""
        return ("|" if self.impact else ">") + outcome + (f" ({' & '.join(self.changes)})" if self.changes else "")


@check_record
@dataclass(frozen=True)
class PhaseSequence:
    """The phases of one period of a robot with any contacts, and the events between them.

    Attributes
    ----------
    phases : tuple of tuples of (str, Mode)
        Closed contacts of each phase and their modes.
    events : tuple of PhaseEvent
        Event at the end of each phase.

    Examples
    --------
    >>> sequence = PhaseSequence.parse("foot A slip+, foot B stick > foot B stick |")
    >>> len(sequence.phases), str(sequence)
    (2, 'foot A slip+, foot B stick > foot B stick |')
    >>> sequence == PhaseSequence.parse("foot A slip+, foot B stick > (foot A opens) foot B stick |").without_changes()
    True
    """

    phases: tuple[Modes, ...]
    events: tuple[PhaseEvent, ...]

    @classmethod
    def parse(cls, text: "str | PhaseSequence", robot: "PlanarRobot | None" = None) -> "PhaseSequence":
        """Read a sequence from text.

        Parameters
        ----------
        text : str
        robot : PlanarRobot, optional
            Robot whose contacts the sequence is checked against; needed for the sequences of walkers in single support.

        Raises
        ------
        SequenceError
            If the text is invalid, or the robot cannot have the sequence; the message states why.

        Examples
        --------
        >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
        >>> str(PhaseSequence.parse("stick | slip+", compass_with_two_feet()))
        Traceback (most recent call last):
        ...
        gaitopt.errors.SequenceError: The sequence 'foot A stick | [foot B slip+]' is not possible: after an \
impact that ends in 'slip+', contact 'foot B' does not change to mode 'stick'.
        """
        if isinstance(text, PhaseSequence):
            sequence = text
        elif isinstance(text, str) and text.strip() == Mode.ANY.value:
            sequence = PhaseSequence((), ())
        elif not isinstance(text, str):
            raise SequenceError(f"A contact sequence must be text, got {text!r}. {_EXAMPLE}")
        elif robot is not None and _is_single_support(text):
            sequence = _from_single_support(text, robot)
        else:
            sequence = _parse(text, () if robot is None else robot.contact_names)
        return sequence if robot is None else sequence.check(robot)

    def check(self, robot: "PlanarRobot") -> "PhaseSequence":
        """Return the sequence if the robot can have it; raise SequenceError otherwise.

        Stated changes of a closed sequence follow from its phases: the sequence is returned without them.
        """
        for modes in (*self.phases, *(event.outcome for event in self.events if event.outcome is not None)):
            for name, mode in modes:
                _check_contact(str(self), robot, name, mode)
        for number in range(0 if self.is_open else len(self.phases)):
            _check_event(self, robot, number)
        return self if self.is_open else self.without_changes()

    def without_changes(self) -> "PhaseSequence":
        """Return the sequence without stated changes."""
        if not any(event.changes for event in self.events):
            return self
        return replace(self, events=tuple(replace(event, changes=()) for event in self.events))

    @property
    def is_open(self) -> bool:
        """Whether a mode or the whole sequence is left open."""
        outcomes = [event.outcome for event in self.events if event.outcome is not None]
        return not self.phases or any(mode is Mode.ANY for modes in (*self.phases, *outcomes) for _, mode in modes)

    def require_closed(self, purpose: str) -> "PhaseSequence":
        """Return the sequence itself; raise SequenceError if it leaves modes open.

        Examples
        --------
        >>> PhaseSequence.parse("foot any > flight |").require_closed("A sweep")
        Traceback (most recent call last):
        ...
        gaitopt.errors.SequenceError: A sweep needs a sequence without 'any', got 'foot any > flight |'; \
search(problem, sequences=[...]) finds the best sequence that matches it.
        """
        if self.is_open:
            raise SequenceError(
                f"{purpose} needs a sequence without 'any', got '{self}'; search(problem, sequences=[...]) finds the "
                "best sequence that matches it."
            )
        return self

    def states(self, robot: "PlanarRobot") -> tuple[ContactState, ...]:
        """Return the contact state of each phase, in the order of the robot's contacts."""
        return tuple(_state(robot, modes) for modes in self.phases)

    def state_after(self, robot: "PlanarRobot", number: int) -> ContactState:
        """Return the contact state after the event of a phase, in the names of that phase."""
        if number + 1 < len(self.phases):
            return _state(robot, self.phases[number + 1])
        first = [mode for _, mode in _state(robot, self.phases[0]).modes]
        places = range(len(first)) if robot.mirror is None else robot.mirror.contacts
        return ContactState(tuple(zip(robot.contact_names, (first[place] for place in places), strict=True)))

    def outcome(self, robot: "PlanarRobot", number: int) -> ContactState:
        """Return the modes of all contacts in the impact of a phase; a contact without impulse is free.

        A latched stop that an opening contact releases takes part in the impact.
        """
        event, before = self.events[number], _state(robot, self.phases[number])
        if event.outcome is not None:
            return _state(robot, event.outcome)
        modes = dict(self.state_after(robot, number).modes)
        for contact in robot.contacts:
            latched = before.mode(contact.name) is Mode.LATCHED and modes[contact.name] is Mode.FREE
            if latched and contact.released_by is not None and contact.released_by[1]:
                modes[contact.name] = Mode.LATCHED
        return ContactState(tuple(modes.items()))

    def describe_event(self, robot: "PlanarRobot", number: int) -> tuple[str, ...]:
        """Return everything that changes at the event of a phase.

        Examples
        --------
        >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
        >>> robot = compass_with_two_feet()
        >>> sequence = PhaseSequence.parse("foot A slip+, foot B stick > foot B stick |", robot)
        >>> [" & ".join(sequence.describe_event(robot, number)) for number in range(2)]
        ['foot A opens', 'foot A closes & foot B slip+']
        """
        before, after = _state(robot, self.phases[number]), self.state_after(robot, number)
        return list_changes(before, self.outcome(robot, number) if self.events[number].impact else after, after)

    def describe_phases(self) -> tuple[str, ...]:
        """Return the closed contacts and their modes in each phase, as in the text of the sequence.

        Examples
        --------
        >>> PhaseSequence.parse("foot stick > flight |").describe_phases()
        ('foot stick', 'flight')
        """
        return tuple(_text_of(modes) for modes in self.phases)

    def __str__(self) -> str:
        if not self.phases:
            return Mode.ANY.value
        return " ".join(f"{_text_of(modes)} {event}" for modes, event in zip(self.phases, self.events, strict=True))


def _state(robot: "PlanarRobot", modes: Modes) -> ContactState:
    table = dict(modes)
    return ContactState(tuple((name, table.get(name, Mode.FREE)) for name in robot.contact_names))


def _text_of(modes: Modes) -> str:
    return ", ".join(f"{name} {mode.value}" for name, mode in modes) or FLIGHT


def _parse(text: str, contacts: Sequence[str]) -> PhaseSequence:
    """Return the sequence of a text without a check against a robot, whose contacts appear in error messages."""
    parts = re.split(r"(>|\|)\s*(\[[^\]]*\])?\s*(\([^)]*\))?", text)
    if len(parts) < 5 or parts[-1].strip():
        raise SequenceError(f"The sequence {text!r} must end with an event, '>' or '|'. {_EXAMPLE}")
    phases, events = [], []
    for phase, separator, outcome, changes in zip(parts[:-1:4], parts[1::4], parts[2::4], parts[3::4], strict=True):
        phases.append(_read_modes(phase, text, contacts))
        if outcome is not None and separator == ">":
            raise SequenceError(f"The sequence {text!r} states an outcome {outcome} after '>'; only impacts have one.")
        modes = None if outcome is None else _read_modes(outcome[1:-1], text, contacts)
        events.append(PhaseEvent(separator == "|", modes, () if changes is None else read_changes(changes[1:-1], text)))
    return PhaseSequence(tuple(phases), tuple(events))


def _read_modes(part: str, text: str, contacts: Sequence[str]) -> Modes:
    if part.strip() == FLIGHT:
        return ()
    modes: dict[str, Mode] = {}
    for entry in part.split(","):
        name, _, spelling = entry.strip().rpartition(" ")
        known = {**_FEET, **_STOPS, **_OPEN}
        if spelling not in known or not name:
            raise SequenceError(
                f"The sequence {text!r} contains {entry.strip()!r}, which is not a contact and its mode. "
                f"{_suggest_entry(entry.strip(), tuple(known), contacts)} {_EXAMPLE}"
            )
        if name.strip() in modes:
            raise SequenceError(f"The sequence {text!r} names contact {name.strip()!r} twice in one phase.")
        modes[name.strip()] = known[spelling]
    return tuple(modes.items())


def _suggest_entry(entry: str, modes: Sequence[str], contacts: Sequence[str]) -> str:
    """Return what an invalid entry of a phase lacks, its mode or its contact, or the most similar mode."""
    if entry in modes:
        return f"The contact in mode {entry!r} is missing."
    if similar := get_close_matches(entry, contacts, n=1, cutoff=0.8):
        return f"The mode of the contact is missing: write, for example, '{similar[0]} stick'."
    return suggest_mode(entry.rpartition(" ")[2], modes)


def _is_single_support(text: str) -> bool:
    """Return whether a text consists of modes of one foot only; its separators may be wrong."""
    parts = [part.split() for part in re.split(r"[>|]", text)]
    return len(parts) > 1 and all(part and {*part} <= {*_FEET, Mode.ANY.value} for part in parts)


def _from_single_support(text: str, robot: "PlanarRobot") -> PhaseSequence:
    """Return the sequence of a walker whose feet exchange, from that of its stance foot."""
    pairs = [] if robot.mirror is None else list(enumerate(robot.mirror.contacts))
    feet = [(i, j) for i, j in pairs if i < j and robot.contacts[i].slides]
    if len(feet) != 1:
        raise SequenceError(
            f"The sequence {text!r} does not name contacts, but robot {robot.name!r} does not have exactly "
            f"one pair of feet that the mirror exchanges. {_EXAMPLE}"
        )
    sequence = ContactSequence.parse(text)
    stance, landing = (robot.contact_names[place] for place in feet[0])
    phases = tuple(((stance, mode),) for mode in sequence.phases)
    continues = sequence.impact is sequence.phases[0] and not sequence.is_open
    last = PhaseEvent(True, None if continues else ((landing, sequence.impact),))
    return PhaseSequence(phases, (*[PhaseEvent(False)] * (len(phases) - 1), last))


def _check_contact(text: str, robot: "PlanarRobot", name: str, mode: Mode) -> None:
    """Raise SequenceError unless a contact exists and can have a mode."""
    if name not in robot.contact_names:
        raise SequenceError(
            f"The sequence {text!r} names {name!r}, which is not a contact. {suggest(name, robot.contact_names)}"
        )
    contact = robot.contacts[robot.contact_index(name)]
    if contact.falls:
        others = [each.name for each in robot.contacts if not each.falls]
        raise SequenceError(
            f"The sequence {text!r} names {name!r}, but the robot has fallen when this contact closes (falls=True). "
            f"Known: {', '.join(others)}."
        )
    accepted = _accepted_modes(contact)
    if mode.value not in accepted:
        raise SequenceError(
            f"The sequence {text!r} has contact {name!r} in mode {mode.value!r}; accepted: {', '.join(accepted)}."
        )


def _accepted_modes(contact: ContactEntry) -> Sequence[str]:
    if contact.kind == "stop":
        return tuple(_STOPS) if contact.latched else (Mode.CLOSED.value,)
    return (*_FEET, *_OPEN) if contact.slides else (Mode.CLOSED.value, Mode.STICK.value)


def _check_event(sequence: PhaseSequence, robot: "PlanarRobot", number: int) -> None:
    """Raise SequenceError unless the event of a phase can lead to the next phase."""
    event, text = sequence.events[number], str(sequence)
    before, after = sequence.states(robot)[number], sequence.state_after(robot, number)
    if event.changes:
        check_changes(text, number + 1, event.changes, sequence.describe_event(robot, number), (before, after))
    if not event.impact:
        if before == after and len(sequence.phases) > 1:
            raise SequenceError(f"The sequence {text!r} is not possible: no mode changes after phase {number + 1}.")
        return
    outcome = sequence.outcome(robot, number)
    if not any(old is Mode.FREE and outcome.mode(name) is not Mode.FREE for name, old in before.modes):
        raise SequenceError(
            f"The sequence {text!r} is not possible: no contact closes in the impact after phase {number + 1}. "
            f"{_advise_impact(sequence, robot, number)}"
        )
    for name, mode in outcome.modes:
        following = after.mode(name)
        wrong = mode.slips and following is not Mode.FREE and following is not mode
        if wrong or (mode is Mode.FREE and following is not Mode.FREE):
            raise SequenceError(
                f"The sequence {text!r} is not possible: after an impact that ends in {mode.value!r}, contact {name!r} "
                f"does not change to mode {following.value!r}."
            )


def _advise_impact(sequence: PhaseSequence, robot: "PlanarRobot", number: int) -> str:
    """Return how an impact after which no contact is newly closed is stated, or the event without impact."""
    foot = next((contact.name for contact in robot.contacts if contact.slides and not contact.falls), None)
    if foot is not None and not any(sequence.phases):
        return f"Add a phase in which a contact is closed, for example '{foot} stick > flight |'."
    is_last = number == len(sequence.phases) - 1
    spelling = _spell_without_impact(sequence, robot, number)
    if is_last and robot.mirror is None:
        advice = (
            f"Robot {robot.name!r} has no mirror, so the legs are not exchanged before the first phase follows again: "
            "if the other leg lands, state mirror={...} of assemble_planar, or the phases of both legs."
        )
        return f"{advice} Write '>' for an event without impact: '{spelling}'." if spelling else advice
    following = "the first phase, before which the legs are exchanged" if is_last else f"phase {number + 2}"
    advice = f"Add the contact that closes to {following}"
    return f"{advice}, or write '>' for an event without impact: '{spelling}'." if spelling else f"{advice}."


def _spell_without_impact(sequence: PhaseSequence, robot: "PlanarRobot", number: int) -> str:
    """Return the sequence without an impact after a phase; empty if nothing would change there, or it is impossible."""
    if sequence.states(robot)[number] == sequence.state_after(robot, number):
        return ""
    events = list(sequence.events)
    events[number] = PhaseEvent(False)
    try:
        return str(replace(sequence, events=tuple(events)).check(robot))
    except SequenceError:
        return ""
