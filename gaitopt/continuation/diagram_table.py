"""Tables of diagrams: rows of all branches, attributes, and their NetCDF file."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.checksum import append_checksum
from gaitopt.motion.netcdf import write_netcdf
from gaitopt.motion.versions import versions

if TYPE_CHECKING:
    import xarray as xr


def write_diagram(table: "xr.Dataset", path: str | Path) -> Path:
    """Write the table of a diagram to a NetCDF file atomically.

    Raises
    ------
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.
    """
    path = Path(path)
    with write_atomically(path) as temporary:
        write_netcdf(table, temporary, 2 * table.nbytes + 100_000)
        append_checksum(temporary)
    return path


def make_attributes(kind: str, version: int, title: str, facts: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of a table: its kind, and the facts of a diagram that are not in its columns."""
    return {
        "title": title,
        "format": f"gaitopt {kind}",
        "format_version": version,
        "diagram": json.dumps(facts),
        "versions": json.dumps(versions()),
    }


def join_rows(parts: Sequence[NDArray[Any]], columns: int | None = None) -> NDArray[Any]:
    """Return the rows of all branches as one array, which is empty if there are no branches."""
    return np.concatenate(parts) if parts else np.zeros(0 if columns is None else (0, columns))


def pad_columns(rows: NDArray[Any], columns: int) -> NDArray[Any]:
    """Return rows with nan up to a number of columns."""
    return np.pad(rows, ((0, 0), (0, columns - rows.shape[1])), constant_values=np.nan)


def split_complex(name: str, dims: tuple[str, str], values: NDArray[Any]) -> dict[str, Any]:
    """Return complex numbers as two columns, since NetCDF has no complex numbers."""
    return {f"{name}_real": (dims, np.real(values)), f"{name}_imag": (dims, np.imag(values))}
