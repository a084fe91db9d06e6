"""Lock of a study: of two processes that compute the same file or folder, one is refused."""

import contextlib
import glob
import itertools
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaitopt.errors import ArchiveError
from gaitopt.parallel.payload_folder import remove_abandoned_folders

SUFFIX = ".lock"

RANDOM = "?" * 8
"""Random part of the names of temporary files, see :func:`gaitopt.motion.atomic.write_atomically`."""

SUFFIXES = (".h5", ".json")
"""Suffixes of the files that a study writes in its folder; hidden files of others stay."""


@contextmanager
def lock_study(path: Path) -> Iterator[None]:
    """Hold the lock of a study, which the operating system releases if the process is terminated.

    Parameters
    ----------
    path : Path
        File or folder of the study; the lock is ``PATH.lock`` or a file in the folder, which is removed at the end.

    Raises
    ------
    ArchiveError
        If another process holds the lock, or the file cannot be created.

    Examples
    --------
    >>> with lock_study(Path("frontier.nc")):
    ...     Path("frontier.nc.lock").exists()
    True
    >>> Path("frontier.nc.lock").exists()
    False
    """
    try:
        target = Path(os.path.realpath(path))
    except (OSError, ValueError) as error:
        raise ArchiveError(f"Cannot write {str(path)!r}: {error}.") from None
    file = target / f"study{SUFFIX}" if target.is_dir() else target.with_name(target.name + SUFFIX)
    handle = _acquire(path, file)
    try:
        with contextlib.suppress(OSError):  # a full disk; the lock is held all the same
            os.ftruncate(handle, 0)
            os.write(handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        with contextlib.suppress(OSError):  # a file that vanishes, or belongs to another user
            remove_abandoned_files(target)
            remove_abandoned_folders()  # a study of which only the file is missing starts no workers, which remove them
        yield
    finally:
        if os.name == "posix":
            file.unlink(missing_ok=True)  # while it is locked: another process then creates another one
        os.close(handle)
        if os.name != "posix":  # Windows cannot remove an open file
            with contextlib.suppress(OSError):  # another process has opened it already
                file.unlink(missing_ok=True)


def remove_abandoned_files(target: Path) -> None:
    """Remove the temporary files of writers that were killed; nobody else writes the study while it is locked.

    Parameters
    ----------
    target : Path
        File or folder of the study.

    Examples
    --------
    >>> Path(".front-a1b2c3d4.nc").touch()
    >>> remove_abandoned_files(Path("front.nc"))
    >>> Path(".front-a1b2c3d4.nc").exists()
    False
    """
    parts = target.with_name(f"{target.name}.parts")
    abandoned = list(target.parent.glob(f".{glob.escape(target.stem)}-{RANDOM}{glob.escape(target.suffix)}"))
    for folder, suffix in itertools.product((target, parts), SUFFIXES):
        abandoned += folder.glob(f".*-{RANDOM}{suffix}")
    for file in abandoned:
        file.unlink(missing_ok=True)


def _acquire(path: Path, file: Path) -> int:
    """Return the handle of the locked file; one that was removed in the meantime is created again."""
    while True:
        try:
            handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise ArchiveError(f"Cannot write {str(path)!r}: {reason} ({str(file)!r}).") from None
        try:
            _lock(handle)
        except OSError:
            holder = _read_holder(handle)
            os.close(handle)
            raise ArchiveError(
                f"Cannot write {path}: its results are being computed by {holder}. Wait until it ends, or choose "
                "another path."
            ) from None
        if _is_current(handle, file):
            return handle
        os.close(handle)


def _is_current(handle: int, file: Path) -> bool:
    """Return whether a locked file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(handle), file.stat())
    except FileNotFoundError:
        return False


def _read_holder(handle: int) -> str:
    try:
        return os.read(handle, 500).decode(errors="replace") or "another process"
    except OSError:  # Windows does not read a locked file
        return "another process"


if sys.platform == "win32":
    import msvcrt

    def _lock(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
