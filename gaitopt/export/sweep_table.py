"""write_sweep_table: the table of a sweep as CSV, a line for each point."""

import csv
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.printable import column_name

if TYPE_CHECKING:
    import xarray as xr

WITHOUT_UNIT = ("", "1", "SI")
"""Units that column names omit; values in SI units have several."""


@check_arguments
def write_sweep_table(table: "xr.Dataset", path: str | Path, *, sequence: str | None = None) -> Path:
    """Write the table of a sweep as CSV in UTF-8: a line for each point of the grid, a column for each quantity.

    Columns are named by quantity and unit such as ``speed_m_per_s`` or ``peak_torque_hip_Nm``, as in
    :func:`~gaitopt.export.write_csv`.  The first ones are the contact sequence and the axes.  A variable with a value
    for each actuator, contact or multiplier has a column for each of them.  Numbers are written with all digits, nan
    where there is no gait.

    Parameters
    ----------
    table : xarray.Dataset
        As :func:`gaitopt.sweep` and :func:`gaitopt.load_sweep` return it.
    path : str or Path
        Usually ends in ``.csv``.
    sequence : str, optional
        Contact sequence whose points are written; all by default.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the sweep has no such contact sequence.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> import xarray as xr
    >>> dims, sequence = ("sequence", "speed"), ["stick | stick"]
    >>> table = xr.Dataset(
    ...     {"status": (dims, [["solved"]]), "period": (dims, [[0.75]], {"units": "s"})},
    ...     {"sequence": sequence, "speed": ("speed", [0.6], {"units": "m/s"})})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print(write_sweep_table(table, f"{folder}/speeds.csv").read_text(encoding="utf-8").strip())
    sequence,speed_m_per_s,status,period_s
    stick | stick,0.6,solved,0.75
    """
    known, path = [str(name) for name in table.sequence.values], Path(path)
    if sequence is not None and sequence not in known:
        raise InputError(f"The sweep has no contact sequence {sequence!r}. {suggest(sequence, known)}")
    selected = table if sequence is None else table.sel(sequence=[sequence])
    columns = dict(_columns(selected))
    with write_atomically(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path


def _columns(table: "xr.Dataset") -> Iterator[tuple[str, list[Any]]]:
    """Yield the name and the values of each column, in the order of the points."""
    dims, shape = table.status.dims, table.status.shape
    for name in (*dims, *table.data_vars):
        variable = table[name]
        unit = str(variable.attrs.get("units", ""))
        units = str(variable.attrs["actuator_units"]).split(", ") if "actuator_units" in variable.attrs else None
        others = [dim for dim in variable.dims if dim not in dims]
        missing = {dim: table[dim] for dim in dims if dim not in variable.dims}  # such as those of an axis
        full = variable.expand_dims(missing).transpose(*dims, *others).values
        labels = list(itertools.product(*(_list_labels(table, dim) for dim in others)))
        columns = np.moveaxis(full.reshape(int(np.prod(shape)), -1), 1, 0)
        for label, each, values in zip(labels, units or [unit] * len(labels), columns, strict=True):
            yield _name_column(str(name), label, each), values.tolist()


def _list_labels(table: "xr.Dataset", dim: Any) -> list[str]:
    """Return the names along a dimension; numbers from 1 if it has none."""
    return list(map(str, table[dim].values if dim in table.coords else range(1, table.sizes[dim] + 1)))


def _name_column(name: str, label: tuple[str, ...], unit: str) -> str:
    """Return the name of a column with its unit.

    Examples
    --------
    >>> _name_column("speed", (), "m/s"), _name_column("peak_torque", ("left hip",), "N m")
    ('speed_m_per_s', 'peak_torque_left_hip_Nm')
    >>> _name_column("stable", (), "1"), _name_column("objective", (), "N^2 m^2 s")
    ('stable', 'objective_N2m2s')
    """
    parts = [part.replace("^", "").replace(" ", "").replace("/", "_per_") for part in unit.split(" or ")]
    suffix = [] if unit in WITHOUT_UNIT else ["_or_".join(parts)]
    return column_name("_".join([name, *label, *suffix]))
