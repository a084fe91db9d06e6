"""Enumeration of contact sequences: periodic ones, their neighbours, and degenerate ones."""

import functools
import itertools
from collections.abc import Iterable, Iterator

from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.ocp.transcription.method import check_count

_MODES = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)


def enumerate_sequences(phases: int) -> tuple[ContactSequence, ...]:
    """Return every contact sequence of a periodic step with at most `phases` phases, shorter ones first.

    Examples
    --------
    >>> [str(sequence) for sequence in enumerate_sequences(1)]
    ['stick | stick', 'slip+ | stick', 'slip+ | slip+', 'slip- | stick', 'slip- | slip-']
    """
    check_count("max_phases", phases, 1, 6)
    return tuple(
        sequence
        for count in range(1, phases + 1)
        for modes in itertools.product(_MODES, repeat=count)
        for impact in dict.fromkeys((Mode.STICK, modes[0]))
        if (sequence := periodic_sequence(modes, impact)) is not None
    )


def closed_sequences(sequences: Iterable[ContactSequence | str], purpose: str) -> tuple[ContactSequence, ...]:
    """Return the contact sequences of a study, each without open phases and possible in a periodic gait.

    Parameters
    ----------
    sequences : iterable of ContactSequence or str
        At least one.
    purpose : str
        Subject of the error message, such as ``"A sweep"``.

    Raises
    ------
    SequenceError
        If the list is empty, or a sequence is invalid, not periodic, or has open phases.

    Examples
    --------
    >>> [str(sequence) for sequence in closed_sequences(["stick|stick"], "A sweep")]
    ['stick | stick']
    """
    candidates = [sequences] if isinstance(sequences, str | ContactSequence) else list(sequences)
    if not candidates:
        raise SequenceError(f"{purpose} needs a contact sequence, such as 'stick | stick'.")
    return tuple(ContactSequence.parse(sequence).require_closed(purpose).check_periodic() for sequence in candidates)


@functools.lru_cache(maxsize=1024)
def periodic_sequence(phases: tuple[Mode, ...], impact: Mode) -> ContactSequence | None:
    """Return the contact sequence with these phases, or None if no periodic step has them."""
    try:
        return ContactSequence(phases, impact).check_periodic()
    except SequenceError:
        return None


def neighbours(sequence: ContactSequence) -> tuple[ContactSequence, ...]:
    """Return the contact sequences that have one phase more or less, or another impact.

    Examples
    --------
    >>> [str(other) for other in neighbours(ContactSequence.parse("stick | stick"))][:2]
    ['slip+ stick | slip+', 'slip+ stick | stick']
    """
    candidates = {
        other
        for phases in (sequence.phases, *_vary_phases(sequence.phases))
        for impact in (Mode.STICK, phases[0])
        if (other := periodic_sequence(phases, impact)) is not None
    }
    return tuple(sorted(candidates - {sequence}, key=lambda other: (len(other.phases), str(other))))


def _vary_phases(phases: tuple[Mode, ...]) -> Iterator[tuple[Mode, ...]]:
    for i in range(len(phases)):
        if len(phases) > 1:
            yield _merge_equal(phases[:i] + phases[i + 1 :])
    for i, mode in itertools.product(range(len(phases) + 1), _MODES):
        yield (*phases[:i], mode, *phases[i:])
        yield (*phases[: i + 1], mode, *phases[i:])  # in the middle of a phase


def _merge_equal(phases: tuple[Mode, ...]) -> tuple[Mode, ...]:
    """Return phases with consecutive equal ones merged."""
    return tuple(mode for mode, _ in itertools.groupby(phases))


def is_degenerate(gait: Gait, shortest_phase: float) -> ContactSequence | None:
    """Return the shorter sequence to which a gait degenerates, which lacks the phases of minimum duration.

    None if no phase has its minimum duration.
    """
    kept = tuple(part.mode for part in gait.motion.segments if part.duration >= 1.01 * shortest_phase)
    if not kept or len(kept) == len(gait.motion.segments):
        return None
    phases = _merge_equal(kept)
    return periodic_sequence(phases, gait.sequence.impact) or periodic_sequence(phases, Mode.STICK)
