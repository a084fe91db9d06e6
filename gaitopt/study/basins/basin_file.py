"""Basins as labelled datasets and as NetCDF files."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.checksum import append_checksum
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain
from gaitopt.motion.versions import versions

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION, PENDING = "basin", 3, -1

SAME_STATE = 1e-4
"""Largest difference between the last state of a walk and a gait for which the walk ends in that gait (SI units)."""

_SEPARATOR = ", "
"""Separator of labels in the attribute ``flag_meanings``; labels contain blanks, but no commas."""

_UNITS = {"_rate": "rad/s", "foot_speed": "m/s"}
"""Units of section coordinates by the suffix of their names; all others are angles."""


@dataclass(frozen=True, eq=False)
class Endings:
    """The endings of walks.

    Attributes
    ----------
    labels : tuple of str
        Kinds of ending: contact sequences of gaits, keys of stops, ``"unsettled"``.
    outcome : (n,) int array
        Index into `labels`, or -1 if not computed yet.
    steps : (n,) int array
        Steps until the ending.
    final : (n, n_z) array
        Last point of each walk on the section with foot speed.
    """

    labels: tuple[str, ...]
    outcome: NDArray[np.int16]
    steps: NDArray[np.int32]
    final: Array


def make_basin(key: dict[str, Any], units: dict[str, str], coordinates: Sequence[str], ends: Endings) -> "xr.Dataset":
    """Return a basin as a dataset.

    Parameters
    ----------
    key : dict
        Robot, parameters, base, axes and method, as returned by
        :meth:`gaitopt.study.basins.basin_walk.BasinWalk.key`.
    units : dict of str to str
        Units of the robot's parameters.
    coordinates : sequence of str
        Names of the n_z coordinates of the section.
    ends : Endings
        Endings of the starts, in C order of the axes.
    """
    import xarray as xr

    axes = {name: np.array(values) for name, values in key["axes"].items()}
    dims, shape = tuple(axes), tuple(values.size for values in axes.values())
    flags = {
        "long_name": "how the walk ends",
        "units": "1",
        "flag_values": np.arange(len(ends.labels), dtype=np.int16),
        "flag_meanings": _SEPARATOR.join(ends.labels),
        "pending": np.int16(PENDING),
    }
    table = {
        "ending": (dims, ends.outcome.reshape(shape), flags),
        "steps": (dims, ends.steps.reshape(shape), {"long_name": "steps until the ending", "units": "1"}),
        "final": (
            (*dims, "coordinate"),
            ends.final.reshape(*shape, -1),
            {"long_name": "last point on the section", "units": "SI"},
        ),
    }
    named: dict[str, Any] = {name: (name, values, {"units": _unit(name, units)}) for name, values in axes.items()}
    stored = {name: part for name, part in key.items() if name != "axes"}
    attributes = {
        "title": f"{key['robot']}: where walks end",
        "format": f"gaitopt {KIND}",
        "format_version": VERSION,
        "complete": int(np.all(ends.outcome != PENDING)),
        "question": json.dumps(plain(stored)),
        "versions": json.dumps(versions()),
    }
    return xr.Dataset(table, named | {"coordinate": list(coordinates)}, attributes)


def _unit(name: str, units: dict[str, str]) -> str:
    return units.get(name) or next((unit for end, unit in _UNITS.items() if name.endswith(end)), "rad")


def basin_key(table: "xr.Dataset") -> dict[str, Any]:
    """Return the key of a basin: robot, parameters, base, axes and method, as plain data."""
    axes = {str(name): table[name].values.tolist() for name in table.ending.dims}
    return json.loads(table.attrs["question"]) | {"axes": axes}


def endings_of(table: "xr.Dataset") -> Endings:
    """Return the endings of a basin, its starts in C order of the axes."""
    meanings = str(table.ending.attrs["flag_meanings"])
    return Endings(
        labels=tuple(meanings.split(_SEPARATOR)) if meanings else (),
        outcome=table.ending.values.ravel(),
        steps=table.steps.values.ravel(),
        final=table.final.values.reshape(table.ending.size, -1),
    )


@check_arguments
def ending_labels(table: "xr.Dataset") -> NDArray[np.str_]:
    """Return the ending of each start of a basin, in the shape of its axes; ``""`` if not computed yet.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.basin` or :func:`load_basin`.

    Examples
    --------
    >>> from gaitopt import basin, rimless_wheel
    >>> ending_labels(basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]})).tolist()
    ['fell', 'stick | stick']
    """
    ends = endings_of(table)
    return np.array([*ends.labels, ""])[ends.outcome].reshape(table.ending.shape)


@check_arguments
def ending_shares(table: "xr.Dataset") -> dict[str, float]:
    """Return the share of the computed starts of a basin with each ending, largest first.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.basin` or :func:`load_basin`.

    Examples
    --------
    >>> from gaitopt import basin, rimless_wheel
    >>> ending_shares(basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 1.5, 2.0, 2.1]}))
    {'stick | stick': 0.75, 'fell': 0.25}
    """
    ends = endings_of(table)
    computed = ends.outcome[ends.outcome != PENDING]
    shares = {label: float(np.mean(computed == i)) for i, label in enumerate(ends.labels)} if computed.size else {}
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def fraction_at(table: "xr.Dataset", state: Mapping[str, float], coordinates: Sequence[str]) -> float | None:
    """Return the share of the computed starts whose walks end at a state; None if nothing is computed yet.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.basin` or :func:`load_basin`.
    state : mapping of str to float
        State after touchdown, such as that of a gait; coordinates not named are 0.  Another gait may have the same
        label.
    coordinates : sequence of str
        Coordinates of the section with foot speed, in order, as in `final`.
    """
    ends = endings_of(table)
    final = ends.final[ends.outcome != PENDING]
    target = np.array([state.get(name, 0.0) for name in coordinates])
    return float(np.mean(np.max(np.abs(final - target), axis=1) <= SAME_STATE)) if final.size else None


@check_arguments
def save_basin(table: "xr.Dataset", path: str | Path) -> Path:
    """Write a basin to a NetCDF file atomically.

    Raises
    ------
    ArchiveError
        If the file is not writable or the disk is full.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import basin, rimless_wheel
    >>> table = basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_basin(save_basin(table, f"{folder}/basin.nc")).identical(table)
    True
    """
    from gaitopt.motion.netcdf import write_netcdf  # imports h5py, which workers do not need

    path = Path(path)
    with write_atomically(path) as temporary:
        write_netcdf(table, temporary, table.nbytes + 100_000)
        append_checksum(temporary)
    return path


@check_arguments
def load_basin(path: str | Path) -> "xr.Dataset":
    """Read a basin from a file.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_basin("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    from gaitopt.motion.hdf5 import read_hdf5
    from gaitopt.study.storage.netcdf_file import read_table

    with read_hdf5(path, KIND, VERSION) as file:
        if int(np.asarray(file.attrs["format_version"]).item()) == 1:
            return _read_version_1(file)
    return read_table(path, KIND, VERSION)


def _read_version_1(file: Any) -> "xr.Dataset":
    """Return a basin in the format before NetCDF, in which the coordinates of the last points have no names."""
    key = json.loads(file.attrs["question"])
    axes = {name: file[f"axes/{name}"][...].tolist() for name in key["axes"]}
    ends = Endings(
        labels=tuple(json.loads(file.attrs["labels"])),
        outcome=file["outcome"][...],
        steps=file["steps"][...],
        final=file["final"][...],
    )
    coordinates = list(map(str, range(ends.final.shape[1])))
    return make_basin(key | {"axes": axes}, {}, coordinates, ends)
