"""The contact modes of a foot under Coulomb friction."""

from enum import Enum


class Mode(Enum):
    """Contact mode of a foot; the value is how contact sequences and files spell it.

    ========  =====================================================  ===================
    spelling  foot velocity                                          contact force
    ========  =====================================================  ===================
    stick     v_t = v_n = 0                                          abs(f_t) <= mu f_n
    slip+     v_n = 0, v_t > 0 (forward, downhill)                   f_t = -mu f_n
    slip-     v_n = 0, v_t < 0 (backward, uphill)                    f_t = +mu f_n
    free      above the ground                                       f = 0
    any       not a mode but one left open, in a contact sequence to be found
    ========  =====================================================  ===================

    Attributes
    ----------
    sign : int
        Sign of the foot's tangential velocity: +1, -1, or 0 when it does not slip.
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
    ANY = "any"

    def __init__(self, spelling: str) -> None:
        self.sign = {"slip+": 1, "slip-": -1}.get(spelling, 0)
        self.slips = self.sign != 0

    __hash__ = object.__hash__  # each mode is one object; by its name, as Enum has it, takes four times as long

    @property
    def label(self) -> str:
        """How figures spell it: with a true minus sign, which is easier to see than a hyphen."""
        return self.value.replace("-", "\N{MINUS SIGN}")

    @staticmethod
    def slipping(sign: float) -> "Mode":
        """Return the slip mode whose foot velocity has this sign."""
        return Mode.SLIP_FORWARD if sign > 0 else Mode.SLIP_BACKWARD


PHYSICAL = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.FREE)
"""The modes a foot can be in."""
