"""Record of a basin while it is computed, in memory and periodically in its file."""

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaitopt.errors import ArchiveError
from gaitopt.study.basins.basin_file import PENDING, Endings, save_basin

if TYPE_CHECKING:
    import xarray as xr

SAVE_EVERY, SAVE_SHARE = 1.0, 20.0
"""Minimum time between two writes of the file [s], and as a multiple of the duration of a write."""

Index = NDArray[np.intp]


class BasinRecord:
    """Endings of all starts in arrays, about fifty bytes per start; a context manager that writes the file on exit.

    Parameters
    ----------
    known : Endings
        Endings of all starts, pending ones included; it is not modified.
    make : callable
        Returns the dataset of a basin from its endings.
    path : Path or None
        File of the basin.
    """

    def __init__(self, known: Endings, make: "Callable[[Endings], xr.Dataset]", path: Path | None) -> None:
        self._make, self._path, self._due = make, path, 0.0
        self._outcome, self._steps, self._final = known.outcome.copy(), known.steps.copy(), known.final.copy()
        self._numbers = {label: number for number, label in enumerate(known.labels)}
        self.finished = self._known = int(np.sum(known.outcome != PENDING))

    def __contains__(self, key: object) -> bool:
        return False  # only pending starts become tasks

    def __setitem__(self, key: str, walked: tuple[Index, Endings]) -> None:
        index, endings = walked
        numbers = [self._numbers.setdefault(label, len(self._numbers)) for label in endings.labels]
        self._outcome[index] = np.array(numbers, dtype=np.int16)[endings.outcome]
        self._steps[index], self._final[index] = endings.steps, endings.final
        self.finished += index.size
        if time.monotonic() >= self._due:
            self._save()

    def endings(self) -> Endings:
        """Return the endings so far; labels are sorted, so that they do not depend on the order of the tasks."""
        names = list(self._numbers)
        order = sorted(range(len(names)), key=names.__getitem__)
        renumbered = np.full(len(self._numbers) + 1, PENDING, dtype=np.int16)  # the last one stands for PENDING, -1
        renumbered[order] = np.arange(len(order))
        labels = tuple(names[number] for number in order)
        return Endings(labels, renumbered[self._outcome], self._steps.copy(), self._final.copy())

    def basin(self) -> "xr.Dataset":
        """Return the basin so far."""
        return self._make(self.endings())

    def __enter__(self) -> "BasinRecord":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        unchanged = isinstance(error, KeyboardInterrupt) and self.finished == self._known
        if not unchanged and not isinstance(error, ArchiveError):  # the last write of the file has failed
            self._save()

    def _save(self) -> None:
        if self._path is not None:
            began = time.monotonic()
            save_basin(self.basin(), self._path)
            ended = time.monotonic()
            self._due = ended + max(SAVE_EVERY, SAVE_SHARE * (ended - began))
