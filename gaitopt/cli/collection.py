"""Garbage collection of a command."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

ALLOCATIONS = 100_000
"""Number of new objects after which Python searches for unreachable ones; a solve makes fewer."""


@contextmanager
def collect_rarely() -> Iterator[None]:
    """Search for unreachable objects seldom: a command leaves few, and the search takes a tenth of its time."""
    thresholds = gc.get_threshold()
    gc.set_threshold(ALLOCATIONS, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
