"""The contact state of a robot: the mode of each of its contacts."""

from collections.abc import Mapping

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import PHYSICAL, Mode

STANCE, SWING = "stance foot", "swing foot"
"""Contacts of a walker in single support."""


@check_record
@dataclass(frozen=True)
class ContactState:
    """The mode of each contact; hashable, as a key of compiled Functions.

    Attributes
    ----------
    modes : tuple of (str, Mode)
        Name of each contact and its mode.

    Examples
    --------
    >>> state = ContactState.single_support("slip+")
    >>> state.mode("stance foot").value, str(state)
    ('slip+', 'stance foot slip+, swing foot free')
    """

    modes: tuple[tuple[str, Mode], ...]

    @staticmethod
    def of(modes: Mapping[str, Mode | str]) -> "ContactState":
        """Return the state with the modes of contacts by name.

        Raises
        ------
        InputError
            If a mode is not a physical one.
        """
        physical = {mode.value: mode for mode in (*PHYSICAL, Mode.CLOSED, Mode.LATCHED)}
        table = {}
        for name, mode in modes.items():
            spelling = mode.value if isinstance(mode, Mode) else mode
            if spelling not in physical:
                raise InputError(f"{spelling!r} is not a mode of contact {name!r}; accepted: {', '.join(physical)}.")
            table[name] = physical[spelling]
        return ContactState(tuple(table.items()))

    @staticmethod
    def single_support(mode: Mode | str) -> "ContactState":
        """Return the state of a walker whose stance foot is in a mode and whose swing foot is free."""
        return ContactState.of({STANCE: mode, SWING: Mode.FREE})

    def mode(self, contact: str) -> Mode:
        """Return the mode of a contact."""
        return dict(self.modes)[contact]

    @property
    def closed(self) -> tuple[str, ...]:
        """Contacts on the ground."""
        return tuple(name for name, mode in self.modes if mode is not Mode.FREE)

    def __str__(self) -> str:
        return ", ".join(f"{name} {mode.value}" for name, mode in self.modes)
