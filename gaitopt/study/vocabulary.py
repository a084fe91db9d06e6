"""Which words a walk can have, which of them are neighbours, and which are others in disguise."""

import itertools
import math
from collections.abc import Iterable, Iterator

from gaitopt.errors import WordError
from gaitopt.model.modes import Mode
from gaitopt.motion.gait import Gait
from gaitopt.motion.word import Word
from gaitopt.ocp.method import check_count
from gaitopt.ocp.problem import GaitProblem

_MODES = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)


def words_up_to(phases: int) -> tuple[Word, ...]:
    """Return every word of a periodic step with at most so many phases, shorter ones first.

    Examples
    --------
    >>> [str(word) for word in words_up_to(1)]
    ['stick | stick', 'slip+ | stick', 'slip+ | slip+', 'slip- | stick', 'slip- | slip-']
    """
    check_count("max_phases", phases, 1, 6)
    return tuple(
        word
        for count in range(1, phases + 1)
        for modes in itertools.product(_MODES, repeat=count)
        for impact in dict.fromkeys((Mode.STICK, modes[0]))
        if (word := periodic_word(modes, impact)) is not None
    )


def closed_words(given: Iterable[Word | str], purpose: str) -> tuple[Word, ...]:
    """Return the words a study is given, each closed and possible in a periodic gait.

    Parameters
    ----------
    given : iterable of Word or str
        At least one.
    purpose : str
        What needs them, as the subject of the error message.

    Raises
    ------
    WordError
        If there is none, or one of them cannot be read, cannot repeat, or leaves something open.

    Examples
    --------
    >>> [str(word) for word in closed_words(["stick|stick"], "A sweep")]
    ['stick | stick']
    """
    words = [given] if isinstance(given, str | Word) else list(given)
    if not words:
        raise WordError(f"{purpose} needs a word, such as 'stick | stick'.")
    return tuple(Word.parse(word).require_closed(purpose).check_periodic() for word in words)


def periodic_word(phases: tuple[Mode, ...], impact: Mode) -> Word | None:
    """Return the word with these phases, or None if no periodic step can be so."""
    try:
        return Word(phases, impact).check_periodic()
    except WordError:
        return None


def why_impossible(word: Word, problem: GaitProblem) -> str:
    """Return why no periodic gait of a problem can have a word, or "" if none of the known reasons holds.

    Over a periodic step the contact's tangential impulse balances gravity's along the slope, its normal impulse
    gravity's across it: their ratio is -tan(slope).  A foot that slips one way in every phase and at the impact has a
    ratio of the friction coefficient instead.
    """
    modes = {*word.phases, word.impact}
    if any(mode.slips for mode in modes) and math.isinf(problem.friction):
        return "a foot cannot slip on infinite friction"
    if len(modes) > 1 or Mode.STICK in modes or isinstance(problem.slope, tuple):
        return ""
    sign = word.impact.sign
    if math.isclose(sign * problem.friction, math.tan(problem.slope), rel_tol=1e-9):
        return ""
    way = "forward" if sign > 0 else "backward"
    return f"a foot that always slips {way} gains or loses speed with every step"


def neighbours(word: Word) -> tuple[Word, ...]:
    """Return the words that have one phase more or less, or another impact.

    Examples
    --------
    >>> [str(other) for other in neighbours(Word.parse("stick | stick"))][:2]
    ['slip+ stick | slip+', 'slip+ stick | stick']
    """
    found = {
        other
        for phases in (word.phases, *_edited(word.phases))
        for impact in (Mode.STICK, phases[0])
        if (other := periodic_word(phases, impact)) is not None
    }
    return tuple(sorted(found - {word}, key=lambda other: (len(other.phases), str(other))))


def _edited(phases: tuple[Mode, ...]) -> Iterator[tuple[Mode, ...]]:
    for i in range(len(phases)):
        if len(phases) > 1:
            yield _joined(phases[:i] + phases[i + 1 :])
    for i, mode in itertools.product(range(len(phases) + 1), _MODES):
        yield (*phases[:i], mode, *phases[i:])
        yield (*phases[: i + 1], mode, *phases[i:])  # in the middle of a phase


def _joined(phases: tuple[Mode, ...]) -> tuple[Mode, ...]:
    """Return phases with equal ones in a row made one."""
    return tuple(mode for mode, _ in itertools.groupby(phases))


def disguised(gait: Gait, shortest_phase: float) -> Word | None:
    """Return the shorter word a gait would rather have: its own without the phases that last as short as they may.

    None if no phase rests at its shortest duration.
    """
    kept = tuple(part.mode for part in gait.motion.segments if part.duration >= 1.01 * shortest_phase)
    if not kept or len(kept) == len(gait.motion.segments):
        return None
    phases = _joined(kept)
    return periodic_word(phases, gait.word.impact) or periodic_word(phases, Mode.STICK)
