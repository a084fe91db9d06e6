"""Garbage collection of a command."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

ALLOCATIONS = 100_000
"""Number of new objects after which Python searches for unreachable ones; most solves make fewer after imports."""


@contextmanager
def collect_rarely() -> Iterator[None]:
    """Search for unreachable objects seldom: a command leaves few, and the search takes a tenth of its time."""
    thresholds = gc.get_threshold()
    gc.set_threshold(ALLOCATIONS, *thresholds[1:])
    try:
        yield
    finally:
        gc.freeze()  # new objects join the old ones, so that the end of a process is not delayed by a search for them
        gc.unfreeze()
        gc.set_threshold(*thresholds)


def exclude_imported_modules() -> None:
    """Exclude present objects from the search until `collect_rarely` ends: most objects of a solve are its modules."""
    gc.freeze()
