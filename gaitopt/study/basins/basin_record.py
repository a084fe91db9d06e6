"""A basin that is being computed, in memory and from time to time in its file."""

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
"""Least time between two savings of the file [s], and in units of what one takes: a million starts take 50 MB."""

Index = NDArray[np.intp]


class BasinRecord:
    """Endings by task, held in arrays: some fifty bytes a start.  A context, which ends with the file written.

    Parameters
    ----------
    known : Endings
        Endings of all starts, pending ones included; not changed.
    make : callable
        Makes the dataset of a basin from its endings.
    path : Path or None
        The file.
    """

    def __init__(self, known: Endings, make: "Callable[[Endings], xr.Dataset]", path: Path | None) -> None:
        self._make, self._path, self._due = make, path, 0.0
        self._outcome, self._steps, self._final = known.outcome.copy(), known.steps.copy(), known.final.copy()
        self._numbers = {label: number for number, label in enumerate(known.labels)}
        self.finished = int(np.sum(known.outcome != PENDING))

    def __contains__(self, key: object) -> bool:
        return False  # only starts that are pending become tasks

    def __setitem__(self, key: str, walked: tuple[Index, Endings]) -> None:
        index, endings = walked
        numbers = [self._numbers.setdefault(label, len(self._numbers)) for label in endings.labels]
        self._outcome[index] = np.array(numbers, dtype=np.int16)[endings.outcome]
        self._steps[index], self._final[index] = endings.steps, endings.final
        self.finished += index.size
        if time.monotonic() >= self._due:
            self._save()

    def endings(self) -> Endings:
        """Return the endings so far; labels are sorted, whatever came first."""
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
        if not isinstance(error, ArchiveError):  # the file could not be written a moment ago
            self._save()

    def _save(self) -> None:
        if self._path is not None:
            began = time.monotonic()
            save_basin(self.basin(), self._path)
            ended = time.monotonic()
            self._due = ended + max(SAVE_EVERY, SAVE_SHARE * (ended - began))
