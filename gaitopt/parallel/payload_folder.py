"""The folder of the payload of worker processes, removed at the end or, after a termination, at the next start."""

import contextlib
import os
import shutil
import sys
import tempfile
from pathlib import Path

PREFIX = "gaitopt-"

LOCK = "owner.lock"
"""File in the folder that its process locks; the operating system releases the lock when the process ends."""


class PayloadFolder:
    """A temporary folder of this process.

    Folders of terminated processes of the same user are removed first.

    Attributes
    ----------
    path : Path

    Examples
    --------
    >>> folder = PayloadFolder()
    >>> remove_abandoned_folders()  # its process runs
    >>> folder.path.is_dir()
    True
    >>> folder.remove()
    >>> folder.path.exists()
    False
    """

    def __init__(self) -> None:
        with contextlib.suppress(OSError):  # another user's folders, or one that vanishes at the same time
            remove_abandoned_folders()
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self.path = Path(self._folder.name)
        self._handle = _create_lock(self.path)

    def remove(self) -> None:
        """Remove the folder."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
        self._folder.cleanup()


def remove_abandoned_folders() -> None:
    """Remove the folders of processes of this user that have ended without removing them."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        if _is_abandoned(folder / LOCK):
            shutil.rmtree(folder, ignore_errors=True)


if sys.platform == "win32":

    def _create_lock(folder: Path) -> int | None:
        """Return None: a process of Windows cannot remove the folder of another one safely."""
        return None

    def _is_abandoned(lock: Path) -> bool:
        return False
else:
    import fcntl

    def _create_lock(folder: Path) -> int | None:
        """Return the handle of a locked file, which has its name only when it is locked."""
        unlocked = folder / f"{LOCK}.part"
        try:
            handle = os.open(unlocked, os.O_RDWR | os.O_CREAT, 0o600)
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            unlocked.rename(folder / LOCK)
        except OSError:  # a full disk, or a file system without locks
            return None
        return handle

    def _is_abandoned(lock: Path) -> bool:
        """Return whether a lock file of this user is not locked by any process."""
        try:
            if lock.lstat().st_uid != os.getuid():
                return False
            handle = os.open(lock, os.O_RDWR | os.O_NOFOLLOW)
        except OSError:
            return False
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        finally:
            os.close(handle)
        return True
