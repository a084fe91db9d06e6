"""HDF5 files: written atomically with a checksum, and read only if they are intact and of the expected kind."""

import hashlib
import json
from collections.abc import Container, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gaitopt.errors import ArchiveError, GaitoptError, describe_missing_file
from gaitopt.interrupts import stems_from_interrupt
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.checksum import make_block, verify_checksum
from gaitopt.motion.file_probe import probe_file
from gaitopt.motion.file_structure import check_structure

READERS = {
    "gait": "load reads it",
    "sweep": "load_sweep reads it, and load_sweep_gait its gaits",
    "basin": "load_basin reads it",
    "set of basins along a branch": "gaitopt.study.load_branch_basin reads it",
    "branch diagram": "load_diagram reads it and write_branch_page writes its page",
    "diagram of optimal gaits": "load_optima reads it",
    "front": "load_front reads it, and load_front_gait its gaits",
    "gait of several steps": "gaitopt.ocp.load_steps reads it",
}
"""Functions that read each kind of file."""

FIRST_WITH_CHECKSUM = {"gait": 5, "sweep": 2, "basin": 3, "branch diagram": 2}
"""First version of a kind of file that has a checksum; kinds that are not listed have had one from the beginning."""

JSON_CONTENTS = {
    "gaitopt tuned gains": (
        "tuned gains, not a gait or another HDF5 file; 'gaitopt stability GAIT.h5 --law {path}' and 'gaitopt push "
        "GAIT.h5 --law {path}' check the gains with their gait, and 'gaitopt show' and 'gaitopt plot' accept the file"
    ),
    "gaitopt push test": "a push test, not a gait or another HDF5 file; 'gaitopt show' and 'gaitopt plot' accept it",
    "gaitopt audit": "an audit, not a gait or another HDF5 file; 'gaitopt audit -o {path}' resumes it",
}
"""Contents of the JSON files of gaitopt by their format, and the commands that accept them."""

DRAWINGS = dict.fromkeys((".png", ".pdf", ".svg"), "figure") | dict.fromkeys((".gif", ".mp4"), "animation")
DRAWINGS |= {".html": "page", ".csv": "table", ".c": "controller in C", ".h": "controller in C"}
"""What files with a suffix are that gaitopt writes of a result, and that do not contain it."""

PROGRAMS = {"page": "a browser", "table": "a spreadsheet", "controller in C": "an editor"}
"""Programs that open a kind of these files; a viewer opens the others."""

_CACHED_SIZE = 1_000_000
"""Size from which a file is checked once, as long as it does not change [bytes]."""

_CHECKED: dict[Path, tuple[int, ...]] = {}
"""Size and times of large files that were checked."""


@contextmanager
def write_hdf5(path: str | Path) -> Iterator[h5py.File]:
    """Yield an HDF5 file for writing, which replaces `path` when the block succeeds.

    It is written in memory first: the HDF5 library crashes on a full disk (segmentation fault, version 1.14).

    Raises
    ------
    ArchiveError
        If the folder is missing or not writable.

    Examples
    --------
    >>> with write_hdf5("note.h5") as file:
    ...     file.attrs["note"] = "whole"
    >>> Path("note.h5").unlink()
    """
    with write_atomically(path) as temporary:
        with h5py.File(temporary, "w", driver="core", backing_store=False) as file:
            yield file
            file.flush()
            image = file.id.get_file_image()
        temporary.write_bytes(image + make_block(hashlib.sha256(image).hexdigest()))


@contextmanager
def read_hdf5(path: str | Path, kind: str, version: int, *, omit: Container[str] = ()) -> Iterator[h5py.File]:
    """Yield an HDF5 file to read.

    Parameters
    ----------
    path : str or Path
    kind : str
        Kind of content: its attribute ``format`` without the prefix ``gaitopt``.
    version : int
        Newest readable version of the format.
    omit : container of str
        Groups whose structure is not checked; their reader checks it by :func:`check_structure`.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind, or refers to other files.

    Examples
    --------
    >>> with read_hdf5("nowhere.h5", "gait", 2):
    ...     pass
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.h5.
    """
    path = Path(path)
    with _open_and_check(path, omit) as (file, intact):
        _check_format(file, path, kind, version, intact=intact)
        yield file


def identify_file(path: Path) -> dict[str, Any]:
    """Return the kind and the format version of a file, and whether it has a checksum.

    Raises
    ------
    ArchiveError
        If the file is missing or damaged, or was not written by gaitopt.

    Examples
    --------
    >>> identify_file(Path("docs/examples/compass_slip.h5"))
    {'kind': 'gait', 'format_version': 5, 'checksum': True}
    """
    with _open_and_check(path, ()) as (file, intact):
        content = str(file.attrs.get("format", ""))
        if not content.startswith("gaitopt "):
            raise ArchiveError(f"{path} is an HDF5 file, but was not written by gaitopt.")
        return {"kind": content.removeprefix("gaitopt "), "format_version": _version_of(file), "checksum": intact}


@contextmanager
def _open_and_check(path: Path, omit: Container[str]) -> Iterator[tuple[h5py.File, bool]]:
    """Yield a file whose checksum and structure are checked, and whether it has a checksum."""
    if path.is_dir():
        inside = next(iter(sorted(path.glob("*.h5"))), None)
        raise ArchiveError(f"{path} is a folder; specify a file{f' in it, such as {inside}' if inside else ''}.")
    if not path.is_file():
        missing = not path.exists()
        raise ArchiveError(describe_missing_file(path) if missing else f"{path} is a device, a pipe or a socket.")
    _refuse_json(path)
    _refuse_drawing(path)
    if path.suffix == ".py":
        raise ArchiveError(f"{path} is a script, not a result; solve it first: gaitopt solve {path}.")
    try:
        intact = _verify_once(path)
        with h5py.File(path, "r") as file:
            check_structure(file, omit=omit)
            yield file, intact
    except ArchiveError:
        raise
    except GaitoptError as error:
        raise ArchiveError(f"{path} is damaged: {error}") from None
    except OSError as error:
        raise ArchiveError(f"{path} is not a readable HDF5 file: it is damaged or of another kind ({error}).") from None
    except MemoryError:
        raise ArchiveError(f"{path} does not fit into memory.") from None
    except Exception as error:  # whatever the content leads to
        if stems_from_interrupt(error):
            raise KeyboardInterrupt from None
        raise ArchiveError(f"{path} is damaged: {type(error).__name__}: {error}") from None


def _refuse_json(path: Path) -> None:
    """Raise ArchiveError if a file is a result of gaitopt in JSON; any other file is left to its reader."""
    if path.suffix.lower() != ".json":
        return
    try:
        content = JSON_CONTENTS[json.loads(path.read_text(encoding="utf-8"))["format"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return
    raise ArchiveError(f"{path} contains {content.format(path=path)}.")


def _refuse_drawing(path: Path) -> None:
    """Raise ArchiveError if a file has the suffix of a figure, an animation, a page, a table or a controller."""
    kind = DRAWINGS.get(path.suffix.lower())
    if kind is None:
        return
    beside = [path.with_suffix(suffix) for suffix in (".h5", ".nc", ".json")]
    result = next((f", such as {file}" for file in beside if file.is_file()), " (.h5, .nc or .json)")
    article = "an" if kind == "animation" else "a"
    relation = "is exported from" if kind in ("table", "controller in C") else "shows"
    raise ArchiveError(
        f"{path} is {article} {kind}, which does not contain the result that it {relation}; open it in "
        f"{PROGRAMS.get(kind, 'a viewer')}, or specify the file of its result{result}."
    )


def _verify_once(path: Path) -> bool:
    """Return whether a file has a checksum, which is checked; a file without one is tried in another process."""
    facts = path.stat()
    state = (facts.st_size, facts.st_mtime_ns, facts.st_ctime_ns, facts.st_ino)
    if _CHECKED.get(path.absolute()) == state:
        return True
    if not verify_checksum(path):
        probe_file(path)
        return False
    if facts.st_size >= _CACHED_SIZE:
        _CHECKED[path.absolute()] = state
    return True


def _check_format(file: h5py.File, path: Path, kind: str, version: int, *, intact: bool) -> None:
    content = str(file.attrs.get("format", ""))
    if content != f"gaitopt {kind}":
        other = content.removeprefix("gaitopt ")
        if other in READERS:
            raise ArchiveError(
                f"{path} contains a {other}, not a {kind}; 'gaitopt show' and 'gaitopt plot' accept it, and in Python, "
                f"{READERS[other]}."
            )
        raise ArchiveError(f"{path} is an HDF5 file, but not a {kind} written by gaitopt.")
    file_version = _version_of(file)
    if file_version > version:
        raise ArchiveError(
            f"{path} has format version {file_version}; this gaitopt reads up to {version}. Upgrade gaitopt to read it."
        )
    if not intact and file_version >= FIRST_WITH_CHECKSUM.get(kind, 1):
        raise ArchiveError(f"{path} has no checksum: it is damaged, or another program has changed it.")


def _version_of(file: h5py.File) -> int:
    return int(np.asarray(file.attrs.get("format_version", 0)).item())  # NetCDF has it as an array
