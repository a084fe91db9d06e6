"""Exceptions for mistakes a user can correct.

A *mistake* (invalid input, an impossible contact sequence, a damaged file) raises one of these; the message states what
is invalid, where, and what is accepted.  A *numerical failure* (a solver that does not converge, a robot that falls) is
not an exception: the result has a :class:`gaitopt.Status` or a :class:`gaitopt.Stop`.
"""

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["ArchiveError", "GaitoptError", "InputError", "ScriptError", "SequenceError"]


class GaitoptError(Exception):
    """Base class of all exceptions of gaitopt."""


class InputError(GaitoptError, ValueError):
    """An invalid value, name or combination of settings."""


class SequenceError(InputError):
    """An invalid or impossible contact sequence."""


class ArchiveError(GaitoptError):
    """A file that is missing, damaged, of another kind, or not writable."""


class ScriptError(GaitoptError):
    """A problem script that fails to load or to build its problem."""


def suggest(name: str, known: Iterable[str]) -> str:
    """Return a sentence with the most similar known name, then all of them.

    Examples
    --------
    >>> suggest("frction", ["friction", "speed"])
    "Did you mean 'friction'? Known: friction, speed."
    """
    known = list(known)
    near = get_close_matches(name, known, n=1, cutoff=0.5)
    listing = f"Known: {', '.join(known)}." if known else "No names are known."
    return f"Did you mean {near[0]!r}? {listing}" if near else listing
