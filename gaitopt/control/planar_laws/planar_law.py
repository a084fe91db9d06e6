"""PlanarLaw: the control law of a periodic motion with impacts, one law for each part between two of them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from gaitopt.control.law import Law
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.printable import format_count


class PlannedImpulses(NamedTuple):
    """Impulses of the actuators at an impact of a plan.

    Attributes
    ----------
    contact : str
        A contact that closes in the impact; at another impact the impulses do not act.
    values : EventImpulses
    """

    contact: str
    values: EventImpulses


@dataclass(frozen=True, eq=False)
class PlanarLaw:
    """A control law of a planar robot's periodic motion.

    The clock is the time since the section, the impact that ends a period.  There it is reset, new values are latched,
    and the legs are exchanged if the robot has a mirror.  Any other impact, or the stated event, ends a part.  A phase
    variable may replace the clock of a part; see :func:`by_phase_variable`.

    Attributes
    ----------
    name : str
    section : str
        Event that ends a period, such as ``"foot B closes"``.
    parts : tuple of Law
        Law of each part of the period between two impacts; the last one continues until the section.  They have the
        same latched values, which the first one latches.
    impulses : tuple of PlannedImpulses or None
        Impulses of the actuators at the impact that ends each part, None for a part without any; empty if no part has.
    endings : tuple of str or None
        Event without impact that ends each part, such as ``"foot opens"``; None for a part that ends with an impact.
        Empty if all parts do.

    Raises
    ------
    InputError
        If there is no part, or a part has events, pieces by an entry of the state, or other latched values.

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> PlanarLaw("passive", "foot closes", (passive(monopod()),))
    PlanarLaw('passive', section 'foot closes', 1 part)
    """

    name: str
    section: str
    parts: tuple[Law, ...]
    impulses: tuple[PlannedImpulses | None, ...] = ()
    endings: tuple[str | None, ...] = ()

    def __post_init__(self) -> None:
        if not self.parts:
            raise InputError(f"The law {self.name!r} needs a law for each part of its period, got none.")
        parts = format_count(len(self.parts), "part")
        if len(self.impulses) not in (0, len(self.parts)):
            raise InputError(
                f"The law {self.name!r} has {parts}, but {format_count(len(self.impulses), 'entry', 'entries')} of "
                "impulses; accepted are as many as parts, or none."
            )
        if len(self.endings) not in (0, len(self.parts)):
            raise InputError(
                f"The law {self.name!r} has {parts}, but {format_count(len(self.endings), 'ending')}; accepted are as "
                "many as parts, or none."
            )
        for part in self.parts:
            if part.memory.events or part.index is not None:
                raise InputError(
                    f"The law {self.name!r} of a robot with several contacts must be a function of the clock without "
                    f"events, got {part.name!r}."
                )
            if part.memory.values != self.latched:
                raise InputError(
                    f"The parts of the law {self.name!r} must have the same latched values, got {part.memory.values} "
                    f"and {self.latched}."
                )

    def __repr__(self) -> str:
        count = f"{len(self.parts)} part{'s' if len(self.parts) > 1 else ''}"
        return f"PlanarLaw({self.name!r}, section {self.section!r}, {count})"

    @property
    def latched(self) -> tuple[str, ...]:
        """Names of the latched values."""
        return self.parts[0].memory.values

    def ending(self, part: int) -> str | None:
        """Return the event without impact that ends a part; None if an impact ends it."""
        return self.endings[part] if self.endings else None

    @property
    def gain_values(self) -> dict[str, float]:
        """Gains by name."""
        return self.parts[0].gain_values

    def with_gains(self, values: Mapping[str, float]) -> "PlanarLaw":
        """Return the law with other gains in every part; raise InputError if it has no such gain."""
        return replace(self, parts=tuple(part.with_gains(values) for part in self.parts))
