"""Exceptions for mistakes a user can correct.

A *mistake* (invalid input, an impossible contact sequence, a damaged file) raises one of these; the message states what
is invalid, where, and what is accepted.  A *numerical failure* (a solver that does not converge, a robot that falls) is
not an exception: the result has a :class:`gaitopt.Status` or a :class:`gaitopt.Stop`.
"""

import os
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

__all__ = ["ArchiveError", "GaitoptError", "InputError", "NoGaitError", "ScriptError", "SequenceError"]

READABLE = (".h5", ".nc", ".json", ".csv", ".mat", ".sto", ".py", ".urdf", ".xml")
"""Suffixes of the files that gaitopt reads; the first one is proposed if several files have the same name."""


NAN_CAUSES = (
    "either a number in it is nan, or a function of the module math was applied to an expression, which gives nan: use "
    "that of casadi, such as casadi.sin"
)
"""Causes of nan in an expression, for messages."""


class GaitoptError(Exception):
    """Base class of all exceptions of gaitopt."""


class InputError(GaitoptError, ValueError):
    """An invalid value, name or combination of settings."""


class SequenceError(InputError):
    """An invalid or impossible contact sequence."""


class NoGaitError(InputError):
    """No gait was found that a method needs as its start; the input itself is valid.  Commands exit with status 1.

    Attributes
    ----------
    gait : Gait or None
        Result of the failed solve, for a file; None if there is none.
    """

    def __init__(self, message: str, gait: object = None) -> None:
        super().__init__(message)
        self.gait = gait


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
    listing = f"Known: {', '.join(known)}." if known else "No names are defined."
    return f"Did you mean {near[0]!r}? {listing}" if near else listing


def join_reasons(reasons: Iterable[object]) -> str:
    """Return reasons in one text, separated by semicolons; those that are sentences lose their period.

    Examples
    --------
    >>> join_reasons(["the replay stopped: The walker fell.", "the period differs by 0.1 s"])
    'the replay stopped: The walker fell; the period differs by 0.1 s'
    """
    return "; ".join(str(reason).removesuffix(".") for reason in reasons)


def describe_missing_file(path: str | Path) -> str:
    """Return that there is no file, with the most similar one of the folder: its name with a suffix, or a similar name.

    The file of a failed solve is named if there is one: the missing file would be that of the gait.

    Examples
    --------
    >>> describe_missing_file("docs/examples/compass_slip").replace(os.sep, "/")
    "There is no file docs/examples/compass_slip. Did you mean 'docs/examples/compass_slip.h5'?"
    """
    path = Path(path)
    try:
        with os.scandir(path.parent) as entries:
            names = sorted(entry.name for entry in entries if entry.name[0] != "." and entry.is_file())
    except OSError:
        names = []
    suffixes = [path.suffix] if path.suffix else reversed(READABLE)
    stems = {Path(name).stem: name for suffix in suffixes for name in names if Path(name).suffix == suffix}
    failed = f"{path.stem}_failed.h5"
    if path.suffix in ("", ".h5") and failed in names and path.stem not in stems:
        failure = path.with_name(failed)
        return f"There is no file {path}: its solve found no gait. 'gaitopt show {failure}' states the reason."
    near = get_close_matches(path.stem, stems, n=1, cutoff=0.75)
    hint = f" Did you mean '{path.with_name(stems[near[0]])}'?" if near else ""
    return f"There is no file {path}.{hint}"
