"""A limited address space: errors that stem from it, and imports that would wait for memory for ever.

SciPy loads OpenBLAS, which tries again and again to reserve its buffers if the operating system refuses them.
"""

import errno
import mmap
import sys

ROOM = 2**28
"""Address space that SciPy takes when it loads OpenBLAS, about 140 MB, and a reserve [bytes]."""

LOADED = "scipy.linalg._fblas", "scipy.special._ufuncs"
"""Modules after whose import OpenBLAS is loaded."""


class RoomFinder:
    """A finder that finds no module and raises MemoryError if there is no room for one that loads OpenBLAS.

    It is not derived from `importlib.abc.MetaPathFinder`, whose import takes longer than all others of this module.
    """

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Return None, so that the next finder is consulted."""
        if name.startswith("scipy.") and not any(module in sys.modules for module in LOADED):
            require_room(ROOM)


def require_room(size: int) -> None:
    """Raise MemoryError unless `size` bytes of the address space are available.

    Examples
    --------
    >>> require_room(1024)
    """
    try:
        mmap.mmap(-1, size).close()
    except (OSError, ValueError, OverflowError) as error:
        raise MemoryError(f"{size} bytes of address space are not available") from error


def check_imports() -> None:
    """Check the room for SciPy before each of its imports if the address space of this process has a limit.

    For processes that gaitopt starts, not for those of its users.
    """
    try:
        import resource
    except ImportError:  # Windows, which has no such limit
        return
    limited = resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY
    if limited and not any(isinstance(finder, RoomFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, RoomFinder())


def lacks_memory(error: BaseException) -> bool:
    """Return whether an error is due to insufficient memory, which an import reports differently.

    With a limit of the address space, Python also fails without any exception set.

    Examples
    --------
    >>> lacks_memory(MemoryError()), lacks_memory(ValueError())
    (True, False)
    """
    if isinstance(error, ImportError):
        return any(words in str(error).lower() for words in ("failed to map segment", "cannot allocate memory"))
    limited = isinstance(error, SystemError) and "without exception set" in str(error)
    return limited or isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM
