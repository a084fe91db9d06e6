"""Import of modules in another thread while the solver of a command iterates and needs no Python."""

import contextlib
import sys
import threading
from collections.abc import Iterable
from importlib import import_module
from types import TracebackType
from typing import Self

SWITCH_INTERVAL = 2e-4
"""Time after which the importing thread yields to the solver [s].  An iteration of the solver needs Python for a
fraction of a millisecond only; with Python's interval it would wait 5 ms for this, longer than it computes."""


class BackgroundImport:
    """Imports modules in another thread, each after an iteration of the solver, until the block ends.

    While an NLP is built, an import would only delay it: both need Python's lock.  A module that fails to be imported
    fails again, with its error, where it is used; one that is not reached is imported there.

    Parameters
    ----------
    modules : iterable of str

    Examples
    --------
    >>> with BackgroundImport(["colorsys"]) as background:
    ...     background.continue_import()
    """

    def __init__(self, modules: Iterable[str]) -> None:
        self._modules = tuple(modules)
        self._iterates, self._ended = threading.Event(), False
        self.thread = threading.Thread(target=self._import_all)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ended = True
        self._iterates.set()

    def continue_import(self) -> None:
        """Import another module when the present one is imported: the solver has begun an iteration."""
        if self.thread.ident is None:
            with contextlib.suppress(RuntimeError):  # no memory for a thread
                self.thread.start()
        self._iterates.set()

    def _import_all(self) -> None:
        for module in self._modules:
            self._iterates.wait()
            if self._ended:
                return
            _import_quietly(module)
            self._iterates.clear()
            if self._ended:  # the end may have been signalled before the signal was cleared
                return


def _import_quietly(module: str) -> None:
    """Import a module if it can be imported."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        with contextlib.suppress(Exception):
            import_module(module)
    finally:
        sys.setswitchinterval(interval)
