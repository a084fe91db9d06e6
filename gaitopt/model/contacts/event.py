"""Events that end a smooth segment of the motion."""

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

    __hash__ = object.__hash__  # four times as fast as the hash of Enum, by the name


class HybridEvent(NamedTuple):
    """An event and the data needed to continue after it.

    Attributes
    ----------
    kind : EventKind
    slip : Mode or None
        Mode that begins at a slip onset.
    number : int
        Number of the switch or event of the law.
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
    """Return the event at which a law changes to another piece, or an actuator reaches or leaves its limit."""
    return HybridEvent(EventKind.LAW_SWITCH, number=number)


def law_event(number: int) -> HybridEvent:
    """Return an event of a law, by its number."""
    return HybridEvent(EventKind.LAW_EVENT, number=number)
