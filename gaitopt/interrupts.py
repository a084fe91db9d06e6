"""Ctrl-C: deferred, turned into a request to stop, or recorded, so that none is lost.

Python raises KeyboardInterrupt between any two instructions of the main thread.  In three places it is lost:

- CasADi clears whatever Python raises while its wrapper converts arguments or is imported: the call then succeeds, or
  fails with an error of another kind.  Inside a solver the exception ends the solve and the iterate is lost.
- Other compiled modules (those written in Cython) clear exceptions while they are imported.
- In callbacks of weak references and in finalisers Python prints the exception and continues.

While interrupts are recorded, the exception is raised a moment later instead, when that call has ended.

The context managers below replace the handler of SIGINT for a block.  They act in the main thread only, where Python
runs signal handlers, and do nothing elsewhere or if the process ignores SIGINT.
"""

import _thread
import inspect
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.machinery import ExtensionFileLoader
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

Handler = Callable[[int, FrameType | None], Any]

_AGAIN = 0.01
"""Time after which an interrupt is repeated that would be lost [s]."""

_IMPORTS = {ExtensionFileLoader.create_module.__code__, ExtensionFileLoader.exec_module.__code__}
"""Code that imports a compiled module."""


_ACTIVE: list["InterruptRecord"] = []
"""Records of the blocks that record interrupts at present, also those whose handler an inner block replaces."""


class InterruptRecord:
    """Record of whether a Ctrl-C was received.

    Attributes
    ----------
    received : bool
    announce : callable or None
        Called at the first Ctrl-C, for example to state when the block ends.
    """

    def __init__(self) -> None:
        self.received = False
        self.announce: Callable[[], None] | None = None

    def receive(self) -> None:
        """Record a Ctrl-C."""
        first, self.received = not self.received, True
        if first and self.announce is not None:
            self.announce()

    def check(self) -> None:
        """Raise KeyboardInterrupt if a Ctrl-C was received."""
        if self.received:
            raise KeyboardInterrupt


def stems_from_interrupt(error: BaseException | None) -> bool:
    """Return whether an error has a KeyboardInterrupt among its causes, as after a Ctrl-C in compiled code.

    Examples
    --------
    >>> error = SystemError("returned a result with an exception set")
    >>> error.__cause__ = KeyboardInterrupt()
    >>> stems_from_interrupt(error), stems_from_interrupt(ValueError())
    (True, False)
    """
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


@contextmanager
def defer_interrupt() -> Iterator[None]:
    """Defer a Ctrl-C to the end of the block, for calls of CasADi that would lose it.

    Examples
    --------
    >>> try:
    ...     with defer_interrupt():
    ...         signal.raise_signal(signal.SIGINT)
    ...         complete = True
    ... except KeyboardInterrupt:
    ...     complete
    True
    """
    received: list[int] = []
    previous: Handler | None = None
    try:
        with _replace_handler(lambda _: lambda number, frame: received.append(number)) as previous:
            yield
    finally:
        if received and previous is not None:
            previous(received[0], inspect.currentframe())


@contextmanager
def stop_on_interrupt(stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` at the first Ctrl-C, so that a solver ends after its iteration and keeps it; a second one raises.

    Examples
    --------
    >>> with stop_on_interrupt(lambda: print("stopping")):
    ...     signal.raise_signal(signal.SIGINT)
    stopping
    """

    def make(previous: Handler) -> Handler:
        def handle(number: int, frame: FrameType | None) -> None:
            signal.signal(signal.SIGINT, previous)
            _record_interrupt()
            stop()

        return handle

    with _replace_handler(make):
        yield


@contextmanager
def hold_interrupt() -> Iterator[InterruptRecord]:
    """Hold the first Ctrl-C until the block calls :meth:`InterruptRecord.check`; a second one raises.

    Examples
    --------
    >>> with hold_interrupt() as interrupt:
    ...     interrupt.check()
    """
    record = InterruptRecord()

    def make(previous: Handler) -> Handler:
        def handle(number: int, frame: FrameType | None) -> None:
            record.receive()
            _record_interrupt()
            signal.signal(signal.SIGINT, previous)

        return handle

    with _replace_handler(make):
        yield record


@contextmanager
def record_interrupts(handler: Handler | None = None) -> Iterator[InterruptRecord]:
    """Record every Ctrl-C while it is handled as usual, since it may be lost or raised as another error.

    Parameters
    ----------
    handler : callable, optional
        Handler of the block; by default the present one.

    Examples
    --------
    >>> with record_interrupts() as interrupt:
    ...     interrupt.received
    False
    """
    record, timers = InterruptRecord(), list[threading.Timer]()

    def make(previous: Handler) -> Handler:
        def handle(number: int, frame: FrameType | None) -> None:
            record.receive()
            if _is_cleared(frame):
                _repeat_interrupt(timers)
            else:
                (handler or previous)(number, frame)

        return handle

    with _replace_handler(make) as previous:
        if previous is None:
            yield record
            return
        _ACTIVE.append(record)
        try:
            with _return_lost_interrupts(timers):
                yield record
        finally:
            _ACTIVE.remove(record)


def _record_interrupt() -> None:
    """Record an interrupt in the blocks around one that replaces their handler."""
    for record in _ACTIVE:
        record.receive()


def _is_cleared(frame: FrameType | None) -> bool:
    """Return whether an exception may be cleared: in CasADi, or while a compiled module is imported."""
    while frame is not None:
        if frame.f_code in _IMPORTS or str(frame.f_globals.get("__name__")).partition(".")[0] == "casadi":
            return True
        frame = frame.f_back
    return False


@contextmanager
def _return_lost_interrupts(timers: list[threading.Timer]) -> Iterator[None]:
    """Repeat a Ctrl-C whose exception Python only prints: in callbacks of weak references and finalisers."""
    former = sys.unraisablehook

    def hook(lost: "UnraisableHookArgs") -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            _repeat_interrupt(timers)
        else:
            former(lost)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = former
        for timer in timers:
            timer.cancel()


def _repeat_interrupt(timers: list[threading.Timer]) -> None:
    """Interrupt the main thread again a moment later, by a timer that is added to a list."""
    timers.append(threading.Timer(_AGAIN, _interrupt_main_thread))
    timers[-1].daemon = True
    timers[-1].start()


def _interrupt_main_thread() -> None:
    """Send SIGINT to the main thread, which also ends a system call that it waits for, where the system allows it."""
    if hasattr(signal, "pthread_kill") and (number := threading.main_thread().ident) is not None:
        signal.pthread_kill(number, signal.SIGINT)
    else:
        _thread.interrupt_main()


@contextmanager
def interrupt_on_termination() -> Iterator[None]:
    """Treat SIGTERM, as sent by ``kill``, ``timeout`` and batch systems, as Ctrl-C in a block.

    By default SIGTERM ends a process without the end of its worker processes: their semaphores and files remain, and
    the resource tracker of loky warns of leaked semaphores.

    Examples
    --------
    >>> try:
    ...     with interrupt_on_termination():
    ...         signal.raise_signal(signal.SIGTERM)
    ... except KeyboardInterrupt:
    ...     "interrupted"
    'interrupted'
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, lambda number, frame: signal.raise_signal(signal.SIGINT))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def block_interrupts() -> Iterator[None]:
    """Block SIGINT, so that processes and threads started in the block inherit the mask and never receive Ctrl-C."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


@contextmanager
def _replace_handler(make: Callable[[Handler], Handler]) -> Iterator[Handler | None]:
    """Replace the handler of SIGINT by one made from it; yield the former one, or None if nothing is replaced."""
    previous = signal.getsignal(signal.SIGINT)
    if not callable(previous) or threading.current_thread() is not threading.main_thread():
        yield None
        return
    signal.signal(signal.SIGINT, make(previous))
    try:
        yield previous
    finally:
        signal.signal(signal.SIGINT, previous)
