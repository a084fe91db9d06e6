"""The contact modes of a foot under Coulomb friction and of a joint stop."""

from collections.abc import Iterable
from enum import Enum

from gaitopt.errors import suggest


class Mode(Enum):
    """Contact mode of a foot or a joint stop; the value is its spelling in contact sequences and files.

    ========  =====================================================  ===================
    spelling  foot velocity                                          contact force
    ========  =====================================================  ===================
    stick     v_t = v_n = 0                                          abs(f_t) <= mu f_n
    slip+     v_n = 0, v_t > 0 (forward, downhill)                   f_t = -mu f_n
    slip-     v_n = 0, v_t < 0 (backward, uphill)                    f_t = +mu f_n
    free      above the ground; a stop: away from its limit          f = 0
    closed    a stop at its limit, v_n = 0                           f_n >= 0
    latched   a stop at its limit, v_n = 0, until it is released     f_n of either sign
    any       not a mode: an open place of a contact sequence
    ========  =====================================================  ===================

    Attributes
    ----------
    sign : int
        Sign of the tangential foot velocity: +1, -1, or 0 if the foot does not slip.
    slips : bool
        Whether the foot slides on the ground.

    Examples
    --------
    >>> Mode("slip+").sign, Mode.STICK.sign
    (1, 0)
    """

    STICK = "stick"
    SLIP_FORWARD = "slip+"
    SLIP_BACKWARD = "slip-"
    FREE = "free"
    CLOSED = "closed"
    LATCHED = "latched"
    ANY = "any"

    def __init__(self, spelling: str) -> None:
        self.sign = {"slip+": 1, "slip-": -1}.get(spelling, 0)
        self.slips = self.sign != 0

    __hash__ = object.__hash__  # four times as fast as the hash of Enum, by the name

    @property
    def label(self) -> str:
        """Spelling in figures, with a minus sign instead of a hyphen."""
        return self.value.replace("-", "\N{MINUS SIGN}")

    @staticmethod
    def slipping(sign: float) -> "Mode":
        """Return the slip mode whose foot velocity has this sign."""
        return Mode.SLIP_FORWARD if sign > 0 else Mode.SLIP_BACKWARD


PHYSICAL = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.FREE)
"""The physical contact modes of a foot."""


def suggest_mode(spelling: str, accepted: Iterable[str]) -> str:
    """Return a sentence with the mode of a similar spelling, or the directions of slip, then all accepted modes.

    Examples
    --------
    >>> suggest_mode("slide", ["stick", "slip+", "slip-"])
    "Slip has a direction: 'slip+' is forward (downhill), 'slip-' backward (uphill). Known: stick, slip+, slip-."
    >>> suggest_mode("stik", ["stick", "slip+", "slip-"])
    "Did you mean 'stick'? Known: stick, slip+, slip-."
    """
    accepted = list(accepted)
    slips = {Mode.SLIP_FORWARD.value, Mode.SLIP_BACKWARD.value} <= {*accepted}
    if slips and spelling.lower().startswith(("slip", "slid")):
        known = f"Known: {', '.join(accepted)}."
        return f"Slip has a direction: 'slip+' is forward (downhill), 'slip-' backward (uphill). {known}"
    return suggest(spelling, accepted)
