"""Events that end a smooth piece of motion."""

from enum import Enum
from typing import NamedTuple

from gaitopt.model.contacts.mode import Mode


class EventKind(Enum):
    """Kind of an event; the value is its label in logs."""

    TOUCHDOWN = "touchdown"
    REST = "at rest"
    SLIP_ONSET = "slip onset"
    LIFT_OFF = "lift-off"
    PAINLEVE = "painleve"
    FALL = "fall"
    LAW_SWITCH = "law switch"
    CUSTOM = "custom"
    SINGULAR = "singular"

    __hash__ = object.__hash__  # each member is one object; by its name, as Enum has it, takes four times as long


class ContactEvent(NamedTuple):
    """An event with what must be known to continue from it.

    Attributes
    ----------
    kind : EventKind
    slip : Mode or None
        Mode that begins at a slip onset.
    number : int
        Which switch of the law, in order.
    name : str
        Name of a custom transition.

    Examples
    --------
    >>> ContactEvent(EventKind.SLIP_ONSET, Mode.SLIP_FORWARD).label, ContactEvent(EventKind.REST).label
    ('slip+', 'at rest')
    """

    kind: EventKind
    slip: Mode | None = None
    number: int = 0
    name: str = ""

    @property
    def label(self) -> str:
        """The event in logs."""
        if self.slip is not None:
            return self.slip.value
        return self.name or self.kind.value


TOUCHDOWN = ContactEvent(EventKind.TOUCHDOWN)
REST = ContactEvent(EventKind.REST)
LIFT_OFF = ContactEvent(EventKind.LIFT_OFF)
PAINLEVE = ContactEvent(EventKind.PAINLEVE)
FALL = ContactEvent(EventKind.FALL)
SINGULAR = ContactEvent(EventKind.SINGULAR)


def law_switch(number: int) -> ContactEvent:
    """Return the event at which a law, not a contact, changes its form."""
    return ContactEvent(EventKind.LAW_SWITCH, number=number)
