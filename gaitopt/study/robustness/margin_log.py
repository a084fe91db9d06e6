"""Log of the searches for robustness margins that are not finished, which worker processes write to a folder."""

import contextlib
import json
import time
from pathlib import Path
from typing import NamedTuple

from gaitopt.progress import VerificationStep


class UnfinishedMargin(NamedTuple):
    """Interval in which a search for the largest disturbance of a kind is at present.

    Attributes
    ----------
    kind : str
    survived : float
        Largest disturbance survived so far.
    failed : float or None
        Smallest disturbance not survived so far.
    unit : str
    walks, most : int
        Number of finished walks, and about the largest number of walks.
    seconds : float [s]
        Time since the beginning.
    """

    kind: str
    survived: float
    failed: float | None
    unit: str
    walks: int
    most: int
    seconds: float

    @property
    def progress(self) -> str:
        """Number of walks and remaining time, in words."""
        left = self.seconds / self.walks * max(self.most - self.walks, 0)
        return f"{self.walks} of at most about {self.most} walks, at most about {left:.0f} s left"

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        failed = "" if self.failed is None else f", and {self.failed:.4g}{unit} is not"
        walks = f"{self.walks} walk{'s' * (self.walks != 1)}"
        return f"{self.kind}: {self.survived:.4g}{unit} is survived{failed}, so far, after {walks}"


class MarginLog:
    """The log of one search, which writes its state after each walk.

    Parameters
    ----------
    folder : Path or None
        Nothing is written without a folder.
    kind, unit : str
    most : int
        About the largest number of walks.
    """

    def __init__(self, folder: Path | None, kind: str, unit: str, most: int) -> None:
        self._path = None if folder is None else folder / f"{kind.replace(' ', '_')}.json"
        self._kind, self._unit, self._most, self._began = kind, unit, most, time.perf_counter()
        self._walks, self._radius, self._survived = 0, 0.0, 0.0
        self._failed: float | None = None

    def add_trial(self, survived: float, failed: float | None) -> None:
        """Add a walk after which these are the largest disturbance survived and the smallest one not survived."""
        self._walks += 1
        if self._path is not None:
            seconds = time.perf_counter() - self._began
            state = UnfinishedMargin(self._kind, survived, failed, self._unit, self._walks, self._most, seconds)
            temporary = self._path.with_suffix(".temporary")
            with contextlib.suppress(OSError):  # a worker on another computer has no such folder
                temporary.write_text(json.dumps(state), encoding="utf-8")
                temporary.replace(self._path)

    def add_push(self, step: VerificationStep) -> None:
        """Add a walk of a search for the largest ball of pushes, which continues in a larger ball if all return."""
        if step.radius > self._radius:
            self._survived = self._radius
        elif step.radius < self._radius:
            self._failed = self._radius
        self._radius = step.radius
        self.add_trial(self._survived, self._failed)


def read_margin_log(folder: Path, kind: str) -> UnfinishedMargin | None:
    """Return the present interval of the search of a kind, or None before its first walk has ended."""
    with contextlib.suppress(OSError):
        return UnfinishedMargin(*json.loads((folder / f"{kind.replace(' ', '_')}.json").read_text(encoding="utf-8")))
    return None
