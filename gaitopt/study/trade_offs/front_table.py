"""A front as a labelled dataset and as a file, with the gaits that no other gait dominates and the knee."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.archive import read_gait, write_gait
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.checksum import append_checksum
from gaitopt.motion.file_structure import check_structure, find_group
from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.motion.motion import Array
from gaitopt.motion.netcdf import write_netcdf
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.robot_archive import SharedGroups
from gaitopt.motion.summary import plain
from gaitopt.motion.versions import versions
from gaitopt.study.storage.failure_reason import PENDING, UNFINISHED, explain_failure
from gaitopt.study.storage.netcdf_file import read_table
from gaitopt.study.storage.study_key import record_script
from gaitopt.study.trade_offs.front_grid import FrontGrid, Index, point_name
from gaitopt.study.trade_offs.quantity import Quantity, quantity_named

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION = "front", 1

GAITS = "points_of_gaits"
"""Group of the gaits, behind the table's variables in the order of names."""

TABLE = 100_000
"""Upper bound of the size of the table [bytes]."""

EQUAL = 1e-6
"""Relative difference below which two values of a quantity count as equal."""


@dataclass(frozen=True, eq=False)
class Front:
    """Results of a trade-off.

    Attributes
    ----------
    grid : FrontGrid
    quantities : tuple of Quantity
        The cost first.
    gaits : mapping of str to Gait or PlanarGait
        Gaits by the key of their task.
    key : dict
        Key of the study.
    measured : dict of str to dict of str to float
        Measured quantities by the key of the point; those of solved points are missing after an interrupt.
    """

    grid: FrontGrid
    quantities: tuple[Quantity, ...]
    gaits: Mapping[str, AnyGait]
    key: dict[str, Any]
    measured: dict[str, dict[str, float]]

    def gait(self, index: Index, kind: str = "point") -> AnyGait | None:
        """Return the gait of a point, or None if it is not computed yet."""
        return self.gaits.get(f"{kind}-{point_name(index)}")

    def value(self, quantity: Quantity, index: Index) -> float:
        """Return the value of a quantity at a point; nan if no gait is solved or the quantity is not yet measured."""
        gait = self.gait(index)
        if gait is None or not gait.status.ok:
            return math.nan
        if quantity in (self.quantities[0], *self.grid.ends.quantities):
            return quantity.read(gait)
        return self.measured.get(f"point-{point_name(index)}", {}).get(quantity.name, math.nan)

    @property
    def complete(self) -> bool:
        """Whether the gaits of all points are computed and measured."""
        bounded = {self.quantities[0].name, *(quantity.name for quantity in self.grid.ends.quantities)}
        measures = any(quantity.name not in bounded for quantity in self.quantities)
        for index in self.grid.points():
            gait = self.gait(index)
            if gait is None or (measures and gait.status.ok and f"point-{point_name(index)}" not in self.measured):
                return False
        return True


def measure_point(names: tuple[str, ...], gait: AnyGait) -> dict[str, float]:
    """Return the measured quantities of a gait by name."""
    return {name: quantity_named(name).read(gait) for name in names}


def find_front(values: Array) -> Array:
    """Return which points no other point dominates; of equal points the first.

    A point dominates another if no quantity is worse and at least one is better, by more than a relative 1e-6.

    Parameters
    ----------
    values : (n_points, n_quantities) array
        All to be small; rows with nan are not on the front.

    Returns
    -------
    (n_points,) bool array

    Examples
    --------
    >>> find_front(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [1.0, 3.0]])).tolist()
    [True, True, False, False]
    """
    tolerance = EQUAL * np.abs(values)
    kept = np.all(np.isfinite(values), axis=1)
    for i in np.flatnonzero(kept):
        for j in np.flatnonzero(np.all(np.isfinite(values), axis=1)):
            no_worse = np.all(values[j] <= values[i] + tolerance[i])
            better = np.any(values[j] < values[i] - tolerance[i])
            if j != i and no_worse and (better or j < i):
                kept[i] = False
                break
    return kept


def find_knee(values: Array, front: Array) -> int | None:
    """Return the point of a front that is farthest from the straight line or plane between its ends.

    The quantities are scaled to the range from 0 to 1 on the front, so that this point has the smallest sum of them.

    Parameters
    ----------
    values : (n_points, n_quantities) array
        All to be small.
    front : (n_points,) bool array

    Returns
    -------
    int or None
        None if the front has fewer than three points or is not convex anywhere.

    Examples
    --------
    >>> values = np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]])
    >>> find_knee(values, np.array([True, True, True]))
    1
    """
    if np.count_nonzero(front) < 3:
        return None
    least, most = values[front].min(axis=0), values[front].max(axis=0)
    scaled = (values - least) / np.where(most > least, most - least, 1.0)
    sums = np.where(front, scaled.sum(axis=1), math.inf)
    knee = int(np.argmin(sums))
    return knee if sums[knee] < 1 - EQUAL else None


def tabulate_front(front: Front) -> "xr.Dataset":
    """Return the table of a front, the point of the loosest bounds first; numbers are nan where there is no gait."""
    import xarray as xr

    grid, points = front.grid, front.grid.points()
    values = np.array([[front.value(quantity, index) for quantity in front.quantities] for index in points])
    signed = values * [quantity.sign for quantity in front.quantities]
    non_dominated = find_front(signed)
    table: dict[str, Any] = {
        quantity.name: ("point", column, {"units": _unit(front, quantity), "long_name": quantity.meaning})
        for quantity, column in zip(front.quantities, values.T, strict=True)
    }
    for axis, (quantity, bounds) in enumerate(zip(grid.ends.quantities, grid.values, strict=True)):
        column = np.array([bounds[index[axis]] for index in points])
        table[f"bound_{quantity.name}"] = ("point", column, {"units": quantity.unit, "long_name": "bound"})
    table |= _tabulate_end_costs(front)
    solved = [front.gait(index) for index in points]
    table["front"] = (
        "point",
        non_dominated.astype(np.int8),
        {"units": "1", "long_name": "1 where no other gait dominates"},
    )
    knee = find_knee(signed, non_dominated)
    table["knee"] = (
        "point",
        np.array([i == knee for i in range(len(points))], np.int8),
        {"units": "1", "long_name": "knee"},
    )
    table["status"] = ("point", np.array([PENDING if g is None else g.status.key for g in solved], dtype=object))
    reasons = [UNFINISHED if gait is None else explain_failure(gait) for gait in solved]
    table["reason"] = ("point", np.array(reasons, dtype=object))
    verified = [g is not None and g.verification is not None and g.verification.passed for g in solved]
    table["verified"] = (
        "point",
        np.array(verified, np.int8),
        {"units": "1", "long_name": "1 where the gait passes its replay"},
    )
    return xr.Dataset(
        table,
        {"point": ("point", np.arange(len(points)), {"units": "1"})},
        _attributes(front),
    )


def _tabulate_end_costs(front: Front) -> dict[str, Any]:
    """Return the costs of the chains from each end to the other and back, by the names of their variables.

    No gait of one of these chains is continued from a gait of the other, in contrast to the last chains.
    """
    table = {}
    for kind, end in (("forward", "end of lowest cost"), ("backward", "end with the tightest bound")):
        gaits = [front.gait(index, f"{kind}-return") for index in front.grid.points()]
        costs = [gait.solver.objective if gait is not None and gait.status.ok else math.nan for gait in gaits]
        text = f"cost before refinement, in the chain of warm starts from the {end} to the other end and back"
        table[f"{kind}_cost"] = ("point", costs, {"units": _unit(front, front.quantities[0]), "long_name": text})
    return table


def _unit(front: Front, quantity: Quantity) -> str:
    return quantity.unit or front.grid.ends.problem.objective.unit


def _attributes(front: Front) -> dict[str, Any]:
    problem = front.grid.ends.problem
    return {
        "title": f"{problem.name}: trade-off",
        "objective": problem.objective.name,
        "objectives": [quantity.name for quantity in front.quantities],
        "format": f"gaitopt {KIND}",
        "format_version": VERSION,
        "complete": int(front.complete),
        "question": json.dumps(plain(front.key)),
        **record_script(problem),
        "versions": json.dumps(versions()),
    }


def write_front(front: Front, path: Path, room: int) -> "xr.Dataset":
    """Write a front with its gaits, which need `room` bytes, to a file atomically, and return its table."""
    table = tabulate_front(front)
    with write_atomically(path) as temporary:
        write_netcdf(table, temporary, TABLE + room)
        robots: SharedGroups = {}
        with h5py.File(temporary, "a") as file:
            for number, index in enumerate(front.grid.points()):
                gait = front.gait(index)
                if gait is not None:
                    write_gait(file.create_group(f"{GAITS}/{number}"), gait, robots)
        append_checksum(temporary)
    return table


@check_arguments
def load_front(path: str | Path) -> "xr.Dataset":
    """Read the table of a front.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_front("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    return read_table(path, KIND, VERSION, omit={GAITS})


@check_arguments
def load_front_gait(path: str | Path, point: int) -> AnyGait:
    """Read the gait of one point of a front, solved or not.

    Raises
    ------
    InputError
        If the front has no such point, or no gait there.
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_front_gait("nowhere.nc", 0)
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    count = load_front(path).sizes["point"]
    gait: Any = None
    with read_hdf5(path, KIND, VERSION, omit={GAITS}) as file:
        group = find_group(file, f"{GAITS}/{point}")
        if group is not None:
            check_structure(group)
            gait = read_gait(group)
    if gait is None:
        raise InputError(f"The front in {path} has no gait at point {point!r}; its points are 0 to {count - 1}.")
    return gait
