"""Everything that changes at the event between two phases of a contact sequence, and its statement in a text.

A change is a contact and what it does, as results print it: ``"foot A opens"``, ``"knee closes"``, ``"foot B slip+"``.
"""

from collections.abc import Iterable, Mapping

from gaitopt.errors import SequenceError, suggest
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode, suggest_mode

CLOSES, OPENS, RELEASED = "closes", "opens", "released"
_MODES = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.CLOSED, Mode.LATCHED)
_KINDS = (CLOSES, OPENS, RELEASED, *(mode.value for mode in _MODES))


def list_changes(before: ContactState, outcome: ContactState, after: ContactState) -> tuple[str, ...]:
    """Return what changes between two phases.

    Parameters
    ----------
    before, after : ContactState
        Modes of the two phases, in the contact names of the first one.
    outcome : ContactState
        Modes in the impact; those of the next phase at an event without impulse.

    Examples
    --------
    >>> before = ContactState.of({"heel": "stick", "toe": "free"})
    >>> after = ContactState.of({"heel": "free", "toe": "stick"})
    >>> list_changes(before, after, after)
    ('toe closes', 'heel opens')
    """
    closing = [name for name, mode in before.modes if mode is Mode.FREE and outcome.mode(name) is not Mode.FREE]
    changes = [f"{name} {CLOSES}" for name in closing]
    for name, old in before.modes:
        new = after.mode(name)
        if old is Mode.LATCHED and new is not Mode.LATCHED:
            changes.append(f"{name} {RELEASED}")
        elif new is Mode.FREE and (old is not Mode.FREE or name in closing):
            changes.append(f"{name} {OPENS}")
        elif old is not Mode.FREE and old is not new:
            changes.append(f"{name} {new.value}")
    return tuple(changes)


def find_closing(changes: Iterable[str]) -> list[str]:
    """Return the contacts that close by some changes.

    Examples
    --------
    >>> find_closing(["foot B closes", "foot A opens"])
    ['foot B']
    """
    parts = [change.rpartition(" ") for change in changes]
    return [contact for contact, _, kind in parts if kind == CLOSES]


def read_changes(part: str, text: str) -> tuple[str, ...]:
    """Return the changes that a part of a sequence states, separated by ``&``.

    Raises
    ------
    SequenceError
        If an entry is not a contact and what it does, or occurs twice.

    Examples
    --------
    >>> read_changes("foot B closes & foot A  opens", "")
    ('foot B closes', 'foot A opens')
    """
    changes: list[str] = []
    for entry in part.split("&"):
        change = " ".join(entry.split())
        contact, _, kind = change.rpartition(" ")
        if kind not in _KINDS or not contact:
            raise SequenceError(
                f"The sequence {text!r} states the event {change!r}, which is not a contact and what it does "
                f"({', '.join(_KINDS)}). {suggest_mode(kind, _KINDS)}"
            )
        if change in changes:
            raise SequenceError(f"The sequence {text!r} states {change!r} twice at one event.")
        changes.append(change)
    return tuple(changes)


def check_changes(
    text: str, number: int, stated: tuple[str, ...], actual: tuple[str, ...], states: tuple[ContactState, ContactState]
) -> None:
    """Raise SequenceError unless the stated changes are those between two phases, in any order.

    Parameters
    ----------
    text : str
        The sequence.
    number : int
        Number of the phase before the event, from 1.
    stated, actual : tuple of str
    states : two ContactState
        Before and after the event.
    """
    before, after = (dict(state.modes) for state in states)
    where = f"The sequence {text!r} is not possible: at the event after phase {number}"
    for change in stated:
        name = change.rpartition(" ")[0]
        if name not in before:
            raise SequenceError(
                f"The sequence {text!r} names {name!r}, which is not a contact. {suggest(name, before)}"
            )
        if spell_release(change, before) not in {spell_release(each, before) for each in actual}:
            raise SequenceError(
                f"{where}, it states {change!r}, but contact {name!r} is in mode {before[name].value!r} before the "
                f"event and {after[name].value!r} after it."
            )
    known = {spell_release(change, before) for change in stated}
    missing = [change for change in actual if spell_release(change, before) not in known]
    if missing:
        raise SequenceError(f"{where}, it omits {' & '.join(missing)!r}; the changes are {' & '.join(actual)!r}.")


def spell_release(change: str, before: Mapping[str, Mode]) -> str:
    """Return a change with the present name of the release of a latched contact.

    Simulations of earlier versions stated that it opens, and plans that it is closed if it can push from then on.

    Parameters
    ----------
    change : str
    before : mapping of str to Mode
        Modes before the event.

    Examples
    --------
    >>> spell_release("knee opens", {"knee": Mode.LATCHED}), spell_release("foot opens", {"foot": Mode.STICK})
    ('knee released', 'foot opens')
    """
    name, _, kind = change.rpartition(" ")
    return f"{name} {RELEASED}" if before.get(name) is Mode.LATCHED and kind in (OPENS, Mode.CLOSED.value) else change
