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
    LAW_EVENT = "law event"
    CUSTOM = "custom"
    SINGULAR = "singular"

    __hash__ = object.__hash__  # each member is one object; by its name, as Enum has it, takes four times as long


class HybridEvent(NamedTuple):
    """An event with what must be known to continue from it.

    Attributes
    ----------
    kind : EventKind
    slip : Mode or None
        Mode that begins at a slip onset.
    number : int
        Which switch or event of the law, in order.
    name : str
        Name of a custom transition.

    Examples
    --------
    >>> HybridEvent(EventKind.SLIP_ONSET, Mode.SLIP_FORWARD).label, HybridEvent(EventKind.REST).label
    ('slip+', 'at rest')
    """

    kind: EventKind
    slip: Mode | None = None
    number: int = 0
    name: str = ""

    @property
    def label(self) -> str:
        """The event in logs."""
        if self.name:
            return self.name
        return self.kind.value if self.slip is None else self.slip.value


TOUCHDOWN = HybridEvent(EventKind.TOUCHDOWN)
REST = HybridEvent(EventKind.REST)
LIFT_OFF = HybridEvent(EventKind.LIFT_OFF)
PAINLEVE = HybridEvent(EventKind.PAINLEVE)
FALL = HybridEvent(EventKind.FALL)
SINGULAR = HybridEvent(EventKind.SINGULAR)


def law_switch(number: int) -> HybridEvent:
    """Return the event at which a law changes its piece, or an actuator its side."""
    return HybridEvent(EventKind.LAW_SWITCH, number=number)


def law_event(number: int) -> HybridEvent:
    """Return an event of a law, by its number."""
    return HybridEvent(EventKind.LAW_EVENT, number=number)
