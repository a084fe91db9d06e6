"""HDF5 files: written atomically, and read only if they are of the expected kind."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from gaitopt.errors import ArchiveError, SequenceError
from gaitopt.motion.atomic import write_atomically

READERS = {
    "gait": "load reads it",
    "sweep": "load_sweep reads it, and load_sweep_gait its gaits",
    "basin": "load_basin reads it",
}
"""Functions that read each kind of file."""


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
        temporary.write_bytes(image)


@contextmanager
def read_hdf5(path: str | Path, kind: str, version: int) -> Iterator[h5py.File]:
    """Yield an HDF5 file to read.

    Parameters
    ----------
    path : str or Path
    kind : str
        Kind of content: its attribute ``format`` without the prefix ``gaitopt``.
    version : int
        Newest readable version of the format.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind.

    Examples
    --------
    >>> with read_hdf5("nowhere.h5", "gait", 2):
    ...     pass
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.h5.
    """
    path = Path(path)
    if path.is_dir():
        inside = next(iter(sorted(path.glob("*.h5"))), None)
        raise ArchiveError(f"{path} is a folder; specify a file{f' in it, such as {inside}' if inside else ''}.")
    if not path.is_file():
        raise ArchiveError(f"There is no file {path}.")
    try:
        with h5py.File(path, "r") as file:
            _check_format(file, path, kind, version)
            yield file
    except OSError as error:
        raise ArchiveError(f"{path} is not a readable HDF5 file: it is damaged or of another kind ({error}).") from None
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, RuntimeError, SequenceError) as error:
        raise ArchiveError(f"{path} is damaged: {type(error).__name__}: {error}") from None


def _check_format(file: h5py.File, path: Path, kind: str, version: int) -> None:
    content = str(file.attrs.get("format", ""))
    if content != f"gaitopt {kind}":
        other = content.removeprefix("gaitopt ")
        if other in READERS:
            raise ArchiveError(f"{path} contains a {other}, not a {kind}; in Python, {READERS[other]}.")
        raise ArchiveError(f"{path} is an HDF5 file, but not a {kind} written by gaitopt.")
    file_version = int(np.asarray(file.attrs.get("format_version", 0)).item())  # NetCDF has it as an array
    if file_version > version:
        raise ArchiveError(
            f"{path} has format version {file_version}; this gaitopt reads up to {version}. Upgrade gaitopt to read it."
        )
