"""Contact sequences: the contact phases of one step and the outcome of its impact.

``"slip+ stick | slip+"`` reads: after the impact the foot slips forward, then sticks, until a touchdown whose
impact makes the landing foot slip forward.  ``any`` in the place of a phase or of the impact leaves it open:
for ``"slip+ stick | any"`` :func:`gaitopt.solve` determines the impact, for ``"any | any"`` the whole sequence.
"""

import functools
import re

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode, suggest_mode

_PHASES = {mode.value: mode for mode in (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.ANY)}
_EXAMPLE = 'Write phases, "|", impact, for example "slip+ stick | slip+", or "any | any" if all modes are open.'


@check_record
@dataclass(frozen=True)
class ContactSequence:
    """The phases of one step and its impact.

    Attributes
    ----------
    phases : tuple of Mode
        Contact modes of the stance foot in order; ``Mode.ANY`` stands for one or several phases to be determined.
    impact : Mode
        Contact mode of the landing foot after touchdown; ``Mode.ANY`` if it is to be determined.

    Raises
    ------
    SequenceError
        If no step can have this contact sequence; the message states why.

    Examples
    --------
    >>> sequence = ContactSequence.parse("slip+ stick | slip+")
    >>> str(sequence), len(sequence.phases)
    ('slip+ stick | slip+', 2)
    >>> ContactSequence.parse("slip+ stick | any").is_open
    True
    """

    phases: tuple[Mode, ...]
    impact: Mode

    def __post_init__(self) -> None:
        if not self.phases:
            raise SequenceError(f"The contact sequence {str(self)!r} has no phases before its impact. {_EXAMPLE}")
        if Mode.FREE in (*self.phases, self.impact):
            raise SequenceError(
                f"The sequence {str(self)!r} contains 'free': a step with one foot on the ground ends there. "
                f"Use {', '.join(_PHASES)}."
            )
        for stop in {Mode.CLOSED, Mode.LATCHED} & {*self.phases, self.impact}:
            raise SequenceError(
                f"The sequence {str(self)!r} contains {stop.value!r}, a mode of joint stops. Use {', '.join(_PHASES)}."
            )
        for first, second in zip(self.phases, self.phases[1:], strict=False):
            if first is second:
                raise SequenceError(
                    f"The sequence {str(self)!r} repeats {first.value!r}; consecutive phases must differ."
                )

    @property
    def is_open(self) -> bool:
        """Whether a phase or the impact is to be determined."""
        return Mode.ANY in (*self.phases, self.impact)

    @property
    def has_open_phases(self) -> bool:
        """Whether a phase is to be determined."""
        return Mode.ANY in self.phases

    def require_closed(self, purpose: str) -> "ContactSequence":
        """Return the contact sequence itself if it has no open phase or impact.

        Parameters
        ----------
        purpose : str
            Subject of the error message, such as ``"A walk"``.

        Raises
        ------
        SequenceError
            If a phase or the impact is open.

        Examples
        --------
        >>> ContactSequence.parse("any | stick").require_closed("A walk")
        Traceback (most recent call last):
        ...
        gaitopt.errors.SequenceError: A walk needs a contact sequence without 'any', got 'any | stick'; solve() \
determines the modes: use the sequence of the gait that it returns.
        """
        if self.is_open:
            raise SequenceError(
                f"{purpose} needs a contact sequence without 'any', got {str(self)!r}; solve() determines the modes: "
                "use the sequence of the gait that it returns."
            )
        return self

    def admits(self, sequence: "ContactSequence") -> bool:
        """Return whether a closed sequence fits this open one; an open phase stands for any number of phases.

        Examples
        --------
        >>> ContactSequence.parse("any stick | any").admits(ContactSequence.parse("slip+ stick | slip+"))
        True
        >>> ContactSequence.parse("any stick | any").admits(ContactSequence.parse("stick slip- | stick"))
        False
        """
        phases = "".join("(?:\\S+ )*" if mode is Mode.ANY else re.escape(f"{mode.value} ") for mode in self.phases)
        text = "".join(f"{mode.value} " for mode in sequence.phases)
        return self.impact in (sequence.impact, Mode.ANY) and re.fullmatch(phases, text) is not None

    def check_periodic(self) -> "ContactSequence":
        """Return the sequence itself if it can be periodic: slip at the impact must continue in the first phase.

        A single step of a walk that is not periodic may begin with stick and end with a slipping impact.

        Raises
        ------
        SequenceError
            If the impact ends in slip of another direction than that of the first phase.

        Examples
        --------
        >>> ContactSequence.parse("stick | slip+").check_periodic()
        Traceback (most recent call last):
        ...
        gaitopt.errors.SequenceError: The sequence 'stick | slip+' is not periodic: after an impact that ends in \
'slip+' the step must begin with 'slip+', not 'stick'.
        """
        if self.impact.slips and self.phases[0] not in (self.impact, Mode.ANY):
            raise SequenceError(
                f"The sequence {str(self)!r} is not periodic: after an impact that ends in {self.impact.value!r} "
                f"the step must begin with {self.impact.value!r}, not {self.phases[0].value!r}."
            )
        return self

    @classmethod
    def parse(cls, text: "str | ContactSequence") -> "ContactSequence":
        """Read a contact sequence from text.

        Raises
        ------
        SequenceError
            If the text is invalid or no step can have the sequence.

        Examples
        --------
        >>> ContactSequence.parse("slip | stick")
        Traceback (most recent call last):
        ...
        gaitopt.errors.SequenceError: The sequence 'slip | stick' has an unknown mode 'slip'. Slip has \
a direction: 'slip+' is forward (downhill), 'slip-' backward (uphill). Known: stick, slip+, slip-, any.
        """
        if isinstance(text, ContactSequence):
            return text
        if not isinstance(text, str):
            raise SequenceError(f"A contact sequence must be text such as 'stick | stick', got {text!r}. {_EXAMPLE}")
        return _parse(text)

    def __str__(self) -> str:
        return f"{' '.join(mode.value for mode in self.phases)} | {self.impact.value}"


def _mode(token: str, text: str) -> Mode:
    try:
        return Mode(token)
    except ValueError:
        raise SequenceError(
            f"The sequence {text!r} has an unknown mode {token!r}. {suggest_mode(token, _PHASES)}"
        ) from None


def _suggest_spelling(text: str) -> str:
    """Return the spelling of a sequence whose phases or impact are separated by the wrong sign; empty if unknown.

    The last sign is read as that of the impact, and the phases before it are separated by spaces.
    """
    *phases, impact = re.split(r"[>|]", text)
    try:
        sequence = _parse(f"{' '.join(phases)} | {impact}")
    except SequenceError:
        return ""
    spelling = f"Phases are separated by spaces, and the impact by '|': '{sequence}'."
    try:
        sequence.check_periodic()
    except SequenceError as error:
        return f"{spelling} {error}"
    return spelling


@functools.lru_cache(maxsize=128)
def _parse(text: str) -> ContactSequence:
    """Return the contact sequence of a text."""
    parts = text.split("|")
    if len(parts) != 2 or ">" in text:
        excluded = ", and no '>'" if ">" in text else ""
        raise SequenceError(
            f"The sequence {text!r} needs exactly one '|' between its phases and its impact{excluded}. "
            f"{_suggest_spelling(text) or _EXAMPLE}"
        )
    phases, impact = (tuple(_mode(token, text) for token in part.split()) for part in parts)
    if len(impact) != 1:
        raise SequenceError(f"The sequence {text!r} needs exactly one impact after '|', got {len(impact)}. {_EXAMPLE}")
    return ContactSequence(phases, impact[0])
