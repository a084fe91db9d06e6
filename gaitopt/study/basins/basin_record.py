"""A basin that is being filled, in memory and now and then in its file."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from gaitopt.errors import ArchiveError
from gaitopt.motion.motion import Array
from gaitopt.study.basins.basin_file import PENDING, Basin, save_basin

SAVE_EVERY, SAVE_SHARE = 1.0, 20.0
"""The file is written at most so often [s], and after so many times what it took: a million starts take 50 MB."""

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Endings:
    """How some walks ended: a number each into the labels, steps, and the last point on the section."""

    labels: tuple[str, ...]
    outcome: NDArray[np.int16]
    steps: NDArray[np.int32]
    final: Array


class BasinRecord:
    """Endings by task, held in arrays: some fifty bytes a start.  A context, which ends with the file written.

    Parameters
    ----------
    known : Basin
        What is known; left as it is.
    path : Path or None
        The file.
    """

    def __init__(self, known: Basin, path: Path | None) -> None:
        self._known, self._path, self._due = known, path, 0.0
        self._outcome, self._steps, self._final = known.outcome.copy(), known.steps.copy(), known.final.copy()
        self._numbers = {label: number for number, label in enumerate(known.labels)}
        self.finished = int(np.sum(~known.pending()))

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

    def basin(self) -> Basin:
        """Return the basin so far; labels are sorted, whatever came first."""
        names = list(self._numbers)
        order = sorted(range(len(names)), key=names.__getitem__)
        renumbered = np.full(len(self._numbers) + 1, PENDING, dtype=np.int16)  # the last one stands for PENDING, -1
        renumbered[order] = np.arange(len(order))
        return replace(
            self._known,
            labels=tuple(names[number] for number in order),
            outcome=renumbered[self._outcome],
            steps=self._steps.copy(),
            final=self._final.copy(),
        )

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
