"""Ctrl-C held back until it can be answered: Python raises it anywhere, and loses it in some places."""

import signal
import threading
from types import FrameType, TracebackType


class DeferredInterrupt:
    """A context in which the first Ctrl-C waits until :meth:`answer` is called; the second one is not held.

    Python raises KeyboardInterrupt wherever the main thread is, also in the callback of a weak reference, where it is
    printed and forgotten; a long study would then go on to its end.  Outside of the main thread nothing is held.

    Examples
    --------
    >>> with DeferredInterrupt() as interrupt:
    ...     interrupt.answer()
    """

    def __init__(self) -> None:
        self._came = False
        self._former = signal.getsignal(signal.SIGINT)
        self._holds = threading.current_thread() is threading.main_thread() and callable(self._former)

    def answer(self) -> None:
        """Raise KeyboardInterrupt if there was one."""
        if self._came:
            raise KeyboardInterrupt

    def __enter__(self) -> "DeferredInterrupt":
        if self._holds:
            signal.signal(signal.SIGINT, self._hold)
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._holds:
            signal.signal(signal.SIGINT, self._former)

    def _hold(self, number: int, frame: FrameType | None) -> None:
        self._came = True
        signal.signal(signal.SIGINT, self._former)
