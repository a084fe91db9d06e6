"""Atomic writing of files in the format of their suffix."""

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from gaitopt.errors import ArchiveError, InputError

GAIT_SUFFIXES = {".h5": "HDF5", ".hdf5": "HDF5"}
"""Suffixes of gait files, and their format."""


@contextmanager
def write_atomically(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` that replaces it if the block succeeds, and is removed if it fails.

    The file reaches the disk before it is renamed, and the folder after: also if the machine loses its power, `path`
    holds the old content or the new one.

    Raises
    ------
    ArchiveError
        If the folder is missing or not writable.

    Examples
    --------
    >>> with write_atomically("note.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> Path("note.txt").read_text()
    'whole'
    >>> Path("note.txt").unlink()
    """
    path = Path(path)
    temporary = _temporary(path)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        _sync(temporary, os.O_RDWR)
        temporary.replace(path)
        if os.name == "posix":  # Windows cannot open a folder
            _sync(path.parent, os.O_RDONLY)
    except OSError as error:
        raise ArchiveError(f"Cannot write {path}: {error.strerror or error}.") from error
    finally:
        temporary.unlink(missing_ok=True)


def _sync(path: Path, flags: int) -> None:
    """Wait until a file or a folder has reached the disk."""
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def reserve(path: Path, size: int) -> None:
    """Raise OSError unless a disk has room for a file of `size` bytes, for writers that fail on a full disk."""
    if hasattr(os, "posix_fallocate"):
        with path.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(1, size))


def check_writable(path: str | Path) -> None:
    """Raise ArchiveError if `path` is not writable, before the computation of its content."""
    _temporary(Path(path)).unlink()


def check_suffix(path: Path, kinds: Mapping[str, str]) -> str:
    """Return the suffix of a path in lower case, or raise InputError with the accepted ones.

    Parameters
    ----------
    path : Path
    kinds : mapping of str to str
        Accepted suffixes with their dot, and a description of each.

    Examples
    --------
    >>> check_suffix(Path("gait.PNG"), {".png": "image"})
    '.png'
    >>> check_suffix(Path("gait.bmp"), {".png": "image"})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Cannot write gait.bmp: the suffix '.bmp' is not that of a known format. Use .png (image).
    """
    suffix = path.suffix.lower()
    if suffix in kinds:
        return suffix
    possible = ", ".join(f"{kind} ({description})" for kind, description in kinds.items())
    wrong = f"the suffix {suffix!r} is not that of a known format" if suffix else "the file name has no suffix"
    raise InputError(f"Cannot write {path}: {wrong}. Use {possible}.")


def check_gait_suffix(path: Path) -> None:
    """Raise InputError unless a path has the suffix of a gait file; the message states what writes other formats."""
    if path.is_dir():
        return  # which the writer rejects
    try:
        check_suffix(path, GAIT_SUFFIXES)
    except InputError as error:
        raise InputError(
            f"{error} CSV, JSON and C files are written by 'gaitopt export' or write_csv, write_torques and write_c."
        ) from None


def _temporary(path: Path) -> Path:
    """Create an empty temporary file beside `path`."""
    folder = path.parent
    if not folder.is_dir():
        raise ArchiveError(
            f"Cannot write {path}: the folder {folder} does not exist. Create it, or choose another folder."
        )
    if path.is_dir():
        raise ArchiveError(f"Cannot write {path}: it is a folder. Specify a file name.")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=folder)
    except OSError as error:
        raise ArchiveError(
            f"Cannot write {path}: the folder {folder} is not writable ({error.strerror}). Choose another folder with "
            "-o."
        ) from None
    os.close(handle)
    return Path(name)
