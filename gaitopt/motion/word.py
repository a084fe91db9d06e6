"""Words: a gait named by the contact phases of one step and the outcome of its impact.

``"slip+ stick | slip+"`` reads: after the impact the foot slips forward, then sticks, until a touchdown whose
impact makes the landing foot slip forward.  ``any`` in the place of a phase or of the impact leaves it open:
``"slip+ stick | any"`` asks :func:`gaitopt.solve` to find what the impact does, ``"any | any"`` to find all of it.
"""

import re
from dataclasses import dataclass

from gaitopt.errors import WordError, suggest
from gaitopt.model.modes import Mode

_PHASES = {mode.value: mode for mode in (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.ANY)}
_EXAMPLE = 'Write phases, "|", impact, for example "slip+ stick | slip+".'


@dataclass(frozen=True)
class Word:
    """The phases of one step and its impact.

    Attributes
    ----------
    phases : tuple of Mode
        Contact modes of the stance foot in order; ``Mode.ANY`` stands for one phase or several still to be found.
    impact : Mode
        What the landing foot does at touchdown; ``Mode.ANY`` where it is still to be found.

    Raises
    ------
    WordError
        If no step can have this word; the message says why.

    Examples
    --------
    >>> word = Word.parse("slip+ stick | slip+")
    >>> str(word), len(word.phases)
    ('slip+ stick | slip+', 2)
    >>> Word.parse("slip+ stick | any").is_open
    True
    """

    phases: tuple[Mode, ...]
    impact: Mode

    def __post_init__(self) -> None:
        if not self.phases:
            raise WordError(f"The word {str(self)!r} has no phases before its impact. {_EXAMPLE}")
        if Mode.FREE in (*self.phases, self.impact):
            raise WordError(
                f"The word {str(self)!r} contains 'free': a walker with one foot on the ground ends its step there. "
                f"Use {', '.join(_PHASES)}."
            )
        for first, second in zip(self.phases, self.phases[1:], strict=False):
            if first is second:
                raise WordError(f"The word {str(self)!r} repeats {first.value!r}; two equal phases in a row are one.")

    @property
    def is_open(self) -> bool:
        """Whether a phase or the impact is still to be found."""
        return Mode.ANY in (*self.phases, self.impact)

    @property
    def has_open_phases(self) -> bool:
        """Whether a phase is still to be found."""
        return Mode.ANY in self.phases

    def require_closed(self, purpose: str) -> "Word":
        """Return the word itself if nothing in it is left open.

        Parameters
        ----------
        purpose : str
            What needs a closed word, as the subject of the error message.

        Raises
        ------
        WordError
            If a phase or the impact is open.

        Examples
        --------
        >>> Word.parse("any | stick").require_closed("A walk")
        Traceback (most recent call last):
        ...
        gaitopt.errors.WordError: A walk needs a closed word, but 'any | stick' leaves something open; solve() closes \
it: use the word of the gait it returns.
        """
        if self.is_open:
            raise WordError(
                f"{purpose} needs a closed word, but {str(self)!r} leaves something open; solve() closes it: use the "
                "word of the gait it returns."
            )
        return self

    def admits(self, word: "Word") -> bool:
        """Return whether a word can be read into this one's open places; an open phase takes any run of modes.

        Examples
        --------
        >>> Word.parse("any stick | any").admits(Word.parse("slip+ stick | slip+"))
        True
        >>> Word.parse("any stick | any").admits(Word.parse("stick slip- | stick"))
        False
        """
        phases = "".join("(?:\\S+ )*" if mode is Mode.ANY else re.escape(f"{mode.value} ") for mode in self.phases)
        spelled = "".join(f"{mode.value} " for mode in word.phases)
        return self.impact in (word.impact, Mode.ANY) and re.fullmatch(phases, spelled) is not None

    def check_periodic(self) -> "Word":
        """Return the word itself if a periodic gait can have it: what follows the impact must begin the step.

        A single step of a walk that is not periodic may well land slipping and have begun sticking.

        Raises
        ------
        WordError
            If the impact leaves the foot sliding another way than the first phase.

        Examples
        --------
        >>> Word.parse("stick | slip+").check_periodic()
        Traceback (most recent call last):
        ...
        gaitopt.errors.WordError: The word 'stick | slip+' cannot be: an impact that ends in 'slip+' leaves the foot \
sliding, so the step must begin with 'slip+', not 'stick'.
        """
        if self.impact.slips and self.phases[0] not in (self.impact, Mode.ANY):
            raise WordError(
                f"The word {str(self)!r} cannot be: an impact that ends in {self.impact.value!r} leaves the foot "
                f"sliding, so the step must begin with {self.impact.value!r}, not {self.phases[0].value!r}."
            )
        return self

    @classmethod
    def parse(cls, text: "str | Word") -> "Word":
        """Read a word from its spelling.

        Raises
        ------
        WordError
            If the spelling cannot be read or no step can be so.

        Examples
        --------
        >>> Word.parse("slip | stick")
        Traceback (most recent call last):
        ...
        gaitopt.errors.WordError: The word 'slip | stick' has an unknown mode 'slip'. Did you mean 'slip-'? Known: \
stick, slip+, slip-, any.
        """
        if isinstance(text, Word):
            return text
        if not isinstance(text, str):
            raise WordError(f"A word is text such as 'stick | stick', got {text!r}. {_EXAMPLE}")
        parts = text.split("|")
        if len(parts) != 2:
            raise WordError(f"The word {text!r} needs exactly one '|' between its phases and its impact. {_EXAMPLE}")
        phases, impact = (tuple(_mode(token, text) for token in part.split()) for part in parts)
        if len(impact) != 1:
            raise WordError(f"The word {text!r} needs exactly one impact after '|', got {len(impact)}. {_EXAMPLE}")
        return cls(phases, impact[0])

    def __str__(self) -> str:
        return f"{' '.join(mode.value for mode in self.phases)} | {self.impact.value}"


def _mode(token: str, text: str) -> Mode:
    try:
        return Mode(token)
    except ValueError:
        raise WordError(f"The word {text!r} has an unknown mode {token!r}. {suggest(token, _PHASES)}") from None
