"""Checkpoints: the corrections of a trace in a file, so that a repeated trace continues where it was interrupted.

A trace is deterministic: its corrections follow one another in the same order.  A repeated trace therefore takes the
results of the first ones from the file, and computes those that follow.  Each line of the file is an object in JSON,
whose numbers are read exactly as they were written.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError, InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array
from gaitopt.motion.versions import versions

SUFFIX = ".checkpoint"
"""Suffix that is added to the name of the output."""


class Correction(NamedTuple):
    """Result of a correction without the sample of the map, which is evaluated again."""

    z: Array
    value: float
    derivative: Array
    multipliers: NDArray[np.complex128]
    tangent: Array
    iterations: int


@check_arguments
class Checkpoint:
    """Corrections of a trace in a file.

    Parameters
    ----------
    path : str or Path
        File, which is created if it does not exist.
    request : mapping
        Definition of the trace, as plain data.

    Attributes
    ----------
    stored : int
        Corrections in the file when it was opened.

    Raises
    ------
    InputError
        If the file belongs to another trace, or is not writable.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> from gaitopt.continuation import Checkpoint, TraceOptions
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": 0.2269})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for _ in range(2):
    ...         with Checkpoint(f"{folder}/wheel.checkpoint", {"friction": [1.0, 0.95]}) as checkpoint:
    ...             diagram = trace(wheel, {"friction": (1.0, 0.95)}, options=TraceOptions(checkpoint=checkpoint))
    ...         checkpoint.stored > 0
    False
    True
    """

    def __init__(self, path: str | Path, request: Mapping[str, Any]) -> None:
        self.path = Path(path)
        header = json.dumps({"request": request, "versions": versions()}, sort_keys=True, default=str)
        lines = self._read_lines()
        if lines and lines[0] != header:
            raise InputError(
                f"{self.path} belongs to another trace; delete it, or write this trace to a file of another name."
            )
        self._records = [json.loads(line) for line in lines[1:]]
        self.stored, self._place, self._header = len(self._records), 0, header
        try:
            self._rewrite()
        except (ArchiveError, OSError) as error:
            raise InputError(f"The checkpoint {self.path} is not writable: {error}") from None

    def __enter__(self) -> "Checkpoint":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Keep the file, in which every correction is already; delete it after an error before the first solution."""
        if error is not None and all(record["point"] is None for record in self._records):
            self.delete()

    def delete(self) -> None:
        """Delete the file, when the trace is complete."""
        self.path.unlink(missing_ok=True)

    def recall(self, guess: Array, normal: Array) -> tuple[bool, Correction | None]:
        """Return whether the next correction is in the file, and its result, None without convergence."""
        if self._place >= len(self._records):
            return False, None
        record = self._records[self._place]
        if record["key"] != _key(guess, normal):
            self.discard()
            return False, None
        self._place += 1
        point = record["point"]
        return True, None if point is None else _read_correction(point)

    def discard(self) -> None:
        """Discard the corrections that were not recalled: the trace differs from the stored one."""
        self._records = self._records[: self._place]
        self._rewrite()

    def record(self, guess: Array, normal: Array, correction: Correction | None) -> None:
        """Add the result of a correction to the file."""
        point = None if correction is None else _write_correction(correction)
        record = {"key": _key(guess, normal), "point": point}
        self._records.append(record)
        self._place += 1
        with self.path.open("a", encoding="utf-8") as file:
            file.write(f"{json.dumps(record)}\n")

    def _rewrite(self) -> None:
        """Write the whole file, in one step."""
        with write_atomically(self.path) as temporary:
            temporary.write_text("\n".join([self._header, *map(json.dumps, self._records), ""]), encoding="utf-8")

    def _read_lines(self) -> list[str]:
        """Return the complete lines of the file; the last one may have been interrupted."""
        if not self.path.exists():
            return []
        try:
            text = self.path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            raise InputError(f"{self.path} is not a checkpoint of a trace; delete it, or use another name.") from None
        return text.splitlines() if text.endswith("\n") else text.splitlines()[:-1]


def _key(guess: Array, normal: Array) -> str:
    return hashlib.sha256(np.concatenate([guess, normal]).tobytes()).hexdigest()[:16]


def _write_correction(correction: Correction) -> dict[str, Any]:
    return {
        "z": correction.z.tolist(),
        "value": correction.value,
        "derivative": correction.derivative.tolist(),
        "multipliers": [[value.real, value.imag] for value in correction.multipliers.tolist()],
        "tangent": correction.tangent.tolist(),
        "iterations": correction.iterations,
    }


def _read_correction(point: Mapping[str, Any]) -> Correction:
    pairs = [complex(real, imaginary) for real, imaginary in point["multipliers"]]
    return Correction(
        z=np.array(point["z"]),
        value=point["value"],
        derivative=np.array(point["derivative"]),
        multipliers=np.array(pairs, dtype=complex),
        tangent=np.array(point["tangent"]),
        iterations=point["iterations"],
    )
