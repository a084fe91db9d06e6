"""A sweep as a labelled dataset and as a file: a NetCDF table, with the gaits in HDF5 groups beside it."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.archive import read_gait, write_gait
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.checksum import append_checksum
from gaitopt.motion.file_structure import check_structure, find_group
from gaitopt.motion.gait import Gait
from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.motion.netcdf import write_netcdf
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.robot_archive import SharedGroups
from gaitopt.motion.summary import plain
from gaitopt.motion.versions import versions
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.parameters import Parameter
from gaitopt.study.gait_metrics import MEASURES, peak_torques
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, explain_failure
from gaitopt.study.storage.gait_store import check_same_study
from gaitopt.study.storage.netcdf_file import read_table
from gaitopt.study.storage.study_key import record_script
from gaitopt.study.sweeps.planar_sweep import planar_dataset
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepPoint
from gaitopt.study.sweeps.sweep_measures import find_lowest_sequences

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION = "sweep", 2

GAITS = "word_gaits"
"""Group of the gaits.  It sorts behind the table's axes: the HDF5 library looks for the name of an axis by walking
through the file in the order of names, and would pass all gaits on the way, every time."""

TABLE = 2000
"""Upper bound of the size of a point in the table [bytes]."""


@dataclass(frozen=True, eq=False)
class SweepResults:
    """Results of a sweep.

    Attributes
    ----------
    grid : SweepGrid
    gaits : mapping of str to Gait
        Gaits by ``"point-" + name`` of the point, solved or not.
    missing : dict of SweepPoint to (status, reason)
        Points without a gait.
    key : dict
        Key of the study.
    columns : dict of str to (dimensions, values, attributes)
        Further variables of the table.
    measures : tuple of str
        Names of the measures in `columns`.
    interrupted : bool
        Whether the measures are not computed because of an interrupt.
    """

    grid: SweepGrid
    gaits: Mapping[str, Gait]
    missing: dict[SweepPoint, tuple[str, str]]
    key: dict[str, Any]
    columns: dict[str, Any] = field(default_factory=dict)
    measures: tuple[str, ...] = ()
    interrupted: bool = False

    def gait(self, point: SweepPoint) -> Gait | None:
        """Return the gait of a point, or None."""
        return self.gaits.get(f"point-{point.name}")

    @property
    def complete(self) -> bool:
        """Whether all points and measures are computed."""
        return self.pending == 0 and not self.interrupted

    @property
    def found(self) -> dict[SweepPoint, Gait]:
        """The gaits by point, solved or not."""
        return {point: gait for point in self.grid.points() if (gait := self.gait(point)) is not None}

    @property
    def pending(self) -> int:
        """Number of points that are not computed."""
        return sum(status != IMPOSSIBLE for status, _ in self.missing.values())


def to_dataset(findings: SweepResults) -> "xr.Dataset":
    """Return the table of a sweep; numbers are nan where there is no gait."""
    make = planar_dataset if isinstance(findings.grid.problem, PlanarProblem) else _single_support_dataset
    table = make(findings)
    table["lowest_sequence"] = find_lowest_sequences(findings.grid, findings.found)
    problem = findings.grid.problem
    unit = problem.objective_unit if isinstance(problem, PlanarProblem) else problem.objective.unit
    table["objective"].attrs |= {"units": unit or "1", "name": problem.objective.name}
    return table.assign(findings.columns)


def find_cost_variable(table: "xr.Dataset") -> str:
    """Return the variable that a sweep minimises; the cost of transport is that without quadrature error.

    Examples
    --------
    >>> import xarray as xr
    >>> find_cost_variable(xr.Dataset({"objective": ("friction", [1.0], {"name": "torque_squared"})}))
    'objective'
    """
    name = table.objective.attrs.get("name", "") if "objective" in table else "cost_of_transport"
    return "cost_of_transport" if name == "cost_of_transport" else "objective"


def name_variable(table: "xr.Dataset", variable: str) -> str:
    """Return the name of a variable of a sweep; that of the minimised objective is the name of the objective.

    Examples
    --------
    >>> import xarray as xr
    >>> name_variable(xr.Dataset({"objective": ("friction", [1.0], {"name": "torque_squared"})}), "objective")
    'torque_squared'
    """
    return str(table[variable].attrs.get("name", variable)) if variable == "objective" else variable


def _single_support_dataset(findings: SweepResults) -> "xr.Dataset":
    """Return the table of a sweep of a robot in single support, without further columns."""
    import xarray as xr

    grid = findings.grid
    actuators, shape = grid.problem.robot.actuators, grid.shape
    numbers = {measure.name: np.full(shape, math.nan) for measure in MEASURES}
    torque, error = np.full((*shape, len(actuators)), math.nan), np.full(shape, math.nan)
    status, reason = np.full(shape, "", dtype=object), np.full(shape, "", dtype=object)
    verified = np.zeros(shape, dtype=np.int8)
    for point in grid.points():
        at = (point.sequence, *point.index)
        gait = findings.gait(point)
        status[at], reason[at] = findings.missing[point] if gait is None else (gait.status.key, explain_failure(gait))
        if gait is None or not gait.status.ok:
            continue
        for measure in MEASURES:
            numbers[measure.name][at] = measure.read(gait)
        torque[at] = list(peak_torques(gait).values())
        if gait.verification is not None:
            verified[at], error[at] = gait.verification.passed, gait.verification.state_error
    dims = ("sequence", *grid.axes)
    table: dict[str, Any] = {
        measure.name: (dims, numbers[measure.name], {"units": measure.unit, "long_name": measure.meaning})
        for measure in MEASURES
    }
    table["peak_torque"] = ((*dims, "actuator"), torque, {"units": "N m", "long_name": "largest absolute torque"})
    table["status"] = (dims, status, {"long_name": "how the optimisation ended"})
    table["reason"] = (dims, reason, {"long_name": "why there is no gait"})
    table["verified"] = (dims, verified, {"units": "1", "long_name": "1 where the gait passes its replay"})
    table["replay_error"] = (
        dims,
        error,
        {"units": "SI", "long_name": "largest error of the replayed state, in SI units"},
    )
    coordinates: dict[str, Any] = {
        name: (name, values, {"units": grid.unit(name)}) for name, values in grid.axes.items()
    }
    coordinates["sequence"] = [str(sequence) for sequence in grid.sequences]
    coordinates["actuator"] = list(actuators)
    return xr.Dataset(table, coordinates, attributes_of(findings))


def attributes_of(findings: SweepResults) -> dict[str, Any]:
    """Return the attributes of the table of a sweep."""
    return {
        "title": f"{findings.grid.problem.name}: optimal gaits",
        "format": f"gaitopt {KIND}",
        "format_version": VERSION,
        "complete": int(findings.complete),
        "measures": ", ".join(findings.measures),
        "question": json.dumps(plain(findings.key)),
        **record_script(findings.grid.problem),
        "versions": json.dumps(versions()),
    }


def write_sweep(findings: SweepResults, path: Path, room: int) -> "xr.Dataset":
    """Write a sweep to a file atomically, and return its table.

    All gaits are stored in the same file, which can then be moved, sent and cited as a whole.  The disk space for
    `room` bytes of gaits is reserved first.
    """
    table = to_dataset(findings)
    with write_atomically(path) as temporary:
        write_netcdf(table, temporary, room + 100_000 + TABLE * math.prod(findings.grid.shape))
        _write_gaits(findings, temporary)
        append_checksum(temporary)
    return table


def _write_gaits(findings: SweepResults, path: Path) -> None:
    robots: SharedGroups = {}
    with h5py.File(path, "a") as file:
        for point in findings.grid.points():
            gait = findings.gait(point)
            if gait is not None:
                write_gait(file.create_group(f"{GAITS}/{point.name}"), gait, robots)


@check_arguments
def load_sweep(path: str | Path) -> "xr.Dataset":
    """Read the table of a sweep.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_sweep("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    return read_table(path, KIND, VERSION, omit={GAITS})


@check_arguments
def load_sweep_gait(path: str | Path, sequence: str, **coordinates: float) -> AnyGait:
    """Read the gait of one point of a sweep.

    Parameters
    ----------
    path : str or Path
    sequence : str
    **coordinates : float
        Value of each axis, such as ``friction=0.14``, in the unit of the dataset; the nearest point is taken, and a
        value outside the axis is rejected.

    Returns
    -------
    Gait or PlanarGait
        The gait, solved or not; see its status.

    Raises
    ------
    InputError
        If the sweep has no such contact sequence or axis, a value is outside its axis, or there is no gait at that
        point.
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_sweep_gait("nowhere.nc", "stick | stick", friction=0.14)
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    table = load_sweep(path)
    sequences, axes = (
        [str(name) for name in table.sequence.values],
        [name for name in table.status.dims if name != "sequence"],
    )
    if sequence not in sequences:
        raise InputError(f"The sweep in {path} has no contact sequence {sequence!r}. {suggest(sequence, sequences)}")
    if set(coordinates) != set(axes):
        raise InputError(f"A point of the sweep in {path} needs a value for {', '.join(map(str, axes))}.")
    index = [_nearest_index(table[name], coordinates[str(name)]) for name in axes]
    gait: Any = None
    with read_hdf5(path, KIND, VERSION, omit={GAITS}) as file:
        group = find_group(file, f"{GAITS}/{SweepPoint(sequences.index(sequence), tuple(index)).name}")
        if group is not None:
            check_structure(group)
            gait = read_gait(group)
    if gait is None:
        reason = table.reason.values[(sequences.index(sequence), *index)]
        raise InputError(f"The sweep in {path} has no gait at this point: {reason}")
    return gait


def read_named_gaits(path: Path) -> Iterator[tuple[str, AnyGait]]:
    """Yield every gait of a sweep with the name of its point, in the order of the names."""
    with read_hdf5(path, KIND, VERSION, omit={GAITS}) as file:
        gaits = find_group(file, GAITS)
        for name in () if gaits is None else gaits:
            group: Any = find_group(gaits, name)
            check_structure(group)
            gait: Any = read_gait(group)
            yield str(name), gait


def read_sequence_gaits(path: Path, sequence: int) -> dict[tuple[int, ...], AnyGait]:
    """Return the gaits of a contact sequence of a sweep, solved or not, by their index along each axis."""
    gaits: dict[tuple[int, ...], AnyGait] = {}
    with read_hdf5(path, KIND, VERSION, omit={GAITS}) as file:
        groups = find_group(file, GAITS)
        for name in () if groups is None else groups:
            number, *index = map(int, name.split("-"))
            if number == sequence:
                group: Any = find_group(groups, name)
                check_structure(group)
                gaits[tuple(index)] = read_gait(group)
    return gaits


def _nearest_index(axis: "xr.DataArray", value: float) -> int:
    """Return the index of the value of an axis nearest to a value within its range; InputError outside."""
    unit, values = axis.attrs.get("units", "1"), axis.values
    low, high = float(values.min()), float(values.max())
    rounding = 1e-9 * max(abs(low), abs(high))
    lower, upper = low - rounding, high + rounding
    value = Parameter(str(axis.name), low, unit, "", lower=lower, upper=upper).check(value)
    return int(np.argmin(np.abs(values - value)))


def read_stored_sweep(path: Path, key: dict[str, Any]) -> "xr.Dataset | None":
    """Return the sweep of a file, complete or not; None without one; InputError if it contains a different study."""
    if not path.exists():
        return None
    table = load_sweep(path)
    check_same_study(json.loads(table.attrs["question"]), key, path)
    return table


def count_pending(table: "xr.Dataset") -> int:
    """Return the number of points of a sweep that are not computed."""
    return int(np.isin(table.status.values.astype(str), (PENDING, LOST)).sum())
