"""Exceptions for mistakes a user can correct.

A *mistake* (bad input, a contact sequence that cannot be, a corrupt file) raises one of these and says what is wrong,
where, and what to do.  A *numerical failure* (a solver that does not converge, a robot that falls) is not an
exception: it is a :class:`gaitopt.Status` or a :class:`gaitopt.Stop` carried by the result.
"""

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["ArchiveError", "GaitoptError", "InputError", "ScriptError", "SequenceError"]


class GaitoptError(Exception):
    """Base class of every exception gaitopt raises on purpose."""


class InputError(GaitoptError, ValueError):
    """A value, name or combination of settings that cannot be used."""


class SequenceError(InputError):
    """A gait contact sequence that cannot be walked, or cannot be read."""


class ArchiveError(GaitoptError):
    """A file that is missing, corrupt, of another kind, or cannot be written."""


class ScriptError(GaitoptError):
    """A problem script that cannot be loaded or raises while it builds its problem."""


def suggest(name: str, known: Iterable[str]) -> str:
    """Return a sentence that names the nearest known name, then all of them.

    Examples
    --------
    >>> suggest("frction", ["friction", "speed"])
    "Did you mean 'friction'? Known: friction, speed."
    """
    known = list(known)
    near = get_close_matches(name, known, n=1, cutoff=0.5)
    listing = f"Known: {', '.join(known)}." if known else "There are none."
    return f"Did you mean {near[0]!r}? {listing}" if near else listing
