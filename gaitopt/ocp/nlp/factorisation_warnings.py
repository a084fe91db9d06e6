"""Suppression of the warnings of CasADi's factorisations, whose causes are visible in the results."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO


@contextmanager
def discard_warnings() -> Iterator[None]:
    """Discard what the block writes to ``sys.stderr``; other threads write as usual.

    CasADi's LDL writes a warning if a pivot vanishes by cancellation.  The solution is then not finite, which the
    caller checks.

    Examples
    --------
    >>> with discard_warnings():
    ...     _ = sys.stderr.write("a warning")
    """
    stream = _Filter(sys.stderr)
    sys.stderr = stream
    try:
        yield
    finally:
        stream.active = False
        # Blocks of several threads may end in any order.
        while isinstance(sys.stderr, _Filter) and not sys.stderr.active:
            sys.stderr = sys.stderr.stream


class _Filter:
    """A stream that discards what one thread writes while the filter is active."""

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.active, self._thread = stream, True, threading.get_ident()

    def write(self, text: str) -> int:
        """Write a text, or discard it."""
        discarded = self.active and threading.get_ident() == self._thread
        return len(text) if discarded or self.stream is None else self.stream.write(text)

    def flush(self) -> None:
        """Flush the stream, if there is one."""
        if self.stream is not None:
            self.stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)
