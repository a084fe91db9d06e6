"""Basins as data and in files."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.motion.hdf5 import open_hdf5, write_hdf5_atomically
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain

KIND, VERSION, PENDING = "basin", 1, -1

SAME_STATE = 1e-4
"""Largest difference of the last state of a walk from that of a gait in which it has ended (SI units)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Basin:
    """Endings of walks on a grid of starts.

    Attributes
    ----------
    robot : str
    parameters : dict of str to float
        Parameters that are not axes.
    base : dict of str to float
        Coordinates of the start that are not axes.
    axes : dict of str to (K,) array
        One or two axes, in order.
    method : dict
        What else the answer depends on: most steps, tolerance of a walk that repeats, and the law.
    labels : tuple of str
        Kinds of ending: contact sequences of gaits, keys of stops, ``"unsettled"``.
    outcome : (n_starts,) int array
        Index into `labels`, or -1 where not computed yet; starts in C order of the axes.
    steps : (n_starts,) int array
        Steps until the ending.
    final : (n_starts, n_z) array
        Last point of each walk on the section with foot speed.

    Examples
    --------
    >>> empty = Basin.empty("rimless_wheel", {"slope": 0.2}, {}, {"theta_rate": np.array([1.0, 2.0])}, {})
    >>> empty.shape, empty.pending().tolist()
    ((2,), [True, True])
    """

    robot: str
    parameters: dict[str, float]
    base: dict[str, float]
    axes: dict[str, Array]
    method: dict[str, Any]
    labels: tuple[str, ...]
    outcome: NDArray[np.int16]
    steps: NDArray[np.int32]
    final: Array

    @classmethod
    def empty(
        cls,
        robot: str,
        parameters: dict[str, float],
        base: dict[str, float],
        axes: dict[str, Array],
        method: dict[str, Any],
    ) -> "Basin":
        """Return a basin with nothing computed."""
        size = int(np.prod([values.size for values in axes.values()]))
        n_z = len(set(base) | {name for name in axes if name not in parameters})
        return cls(
            robot=robot,
            parameters={name: value for name, value in parameters.items() if name not in axes},
            base=base,
            axes=axes,
            method=method,
            labels=(),
            outcome=np.full(size, PENDING, dtype=np.int16),
            steps=np.zeros(size, dtype=np.int32),
            final=np.full((size, n_z), np.nan),
        )

    @property
    def size(self) -> int:
        """Number of starts."""
        return int(self.outcome.size)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(values.size for values in self.axes.values())

    def pending(self) -> NDArray[np.bool_]:
        """Return which starts are not computed yet, shape (n_starts,)."""
        return self.outcome == PENDING

    def labels_on_grid(self) -> NDArray[np.str_]:
        """Return the ending of each start, in the shape of the axes; ``""`` where not computed yet."""
        return np.array([*self.labels, ""])[self.outcome].reshape(self.shape)

    def fractions(self) -> dict[str, float]:
        """Return the share of the computed starts with each ending, largest first."""
        computed = self.outcome[~self.pending()]
        shares = {label: float(np.mean(computed == i)) for i, label in enumerate(self.labels)} if computed.size else {}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def fraction_at(self, state: Mapping[str, float], coordinates: Sequence[str]) -> float | None:
        """Return the share of the computed starts whose walks end at a state; None if nothing is computed yet.

        Parameters
        ----------
        state : mapping of str to float
            State after touchdown, such as that of a gait; coordinates not named are 0.  Another gait may have the same
            label.
        coordinates : sequence of str
            Coordinates of the section with foot speed, in order, as in `final`.
        """
        final = self.final[~self.pending()]
        target = np.array([state.get(name, 0.0) for name in coordinates])
        distance = np.max(np.abs(final - target), axis=1)
        return float(np.mean(distance <= SAME_STATE)) if final.size else None

    def question(self) -> dict[str, Any]:
        """Return what the basin answers, as plain data."""
        axes = {name: values.tolist() for name, values in self.axes.items()}
        question = [self.robot, self.parameters, self.base, axes, self.method]
        return plain(dict(zip(("robot", "parameters", "base", "axes", "method"), question, strict=True)))


def save_basin(basin: Basin, path: str | Path) -> Path:
    """Write a basin to an HDF5 file, whole or not at all.

    Examples
    --------
    >>> import tempfile
    >>> basin = Basin.empty("rimless_wheel", {"slope": 0.2}, {}, {"theta_rate": np.array([1.0, 2.0])}, {})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_basin(save_basin(basin, f"{folder}/basin.h5")).size
    2
    """
    path = Path(path)
    with write_hdf5_atomically(path) as file:
        file.attrs.update(format=f"gaitopt {KIND}", format_version=VERSION, question=json.dumps(basin.question()))
        file.attrs["labels"] = json.dumps(basin.labels)
        for name, values in basin.axes.items():
            file.create_dataset(f"axes/{name}", data=values)
        for name in ("outcome", "steps", "final"):
            file.create_dataset(name, data=getattr(basin, name))
    return path


def load_basin(path: str | Path) -> Basin:
    """Read a basin from a file.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_basin("nowhere.h5")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.h5.
    """
    with open_hdf5(path, KIND, VERSION) as file:
        question = json.loads(file.attrs["question"])
        return Basin(
            robot=question["robot"],
            parameters={name: float(value) for name, value in question["parameters"].items()},
            base=question["base"],
            axes={name: file[f"axes/{name}"][...] for name in question["axes"]},
            method=question["method"],
            labels=tuple(json.loads(file.attrs["labels"])),
            outcome=file["outcome"][...],
            steps=file["steps"][...],
            final=file["final"][...],
        )
