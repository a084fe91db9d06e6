"""Locks that a forked process can acquire although a thread of its parent held them."""

import os
import threading
from types import TracebackType


class ForkSafeLock:
    """A reentrant lock, which is free in a process that was forked while another thread held it.

    Examples
    --------
    >>> lock = ForkSafeLock()
    >>> with lock, lock:
    ...     pass
    """

    def __init__(self) -> None:
        self._lock, self._local = threading.RLock(), threading.local()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._renew)

    def _renew(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        lock = self._lock
        lock.acquire()
        self._local.acquired = [*getattr(self._local, "acquired", ()), lock]

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        *self._local.acquired, lock = self._local.acquired  # that of the parent, in a process forked in the block
        lock.release()
