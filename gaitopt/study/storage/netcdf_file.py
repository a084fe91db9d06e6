"""Labelled tables in NetCDF files: written atomically, and read only if they are of the expected kind."""

import contextlib
import importlib
import threading
from collections.abc import Container
from pathlib import Path
from typing import TYPE_CHECKING

import h5py

from gaitopt.motion.atomic import reserve
from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.parallel.execution import Execution

if TYPE_CHECKING:
    import xarray as xr

PACKAGES = ("xarray", "h5netcdf", "dask.array", "distributed")
"""Packages that xarray imports for a table and its file, the last two if they are installed."""


def import_ahead(execution: Execution) -> None:
    """Import what tables need while workers run: it takes as long as two solves, and an interrupt must not wait for it.

    Parameters
    ----------
    execution : Execution
        Without workers nothing is imported.
    """

    def import_packages() -> None:
        for name in PACKAGES:
            with contextlib.suppress(ImportError):  # reported when the table is made
                importlib.import_module(name)

    if execution.executor is not None or execution.workers != 1:
        threading.Thread(target=import_packages, daemon=True).start()


def write_table(table: "xr.Dataset", path: Path, room: int) -> None:
    """Write a table to a new file after reserving `room` bytes on the disk, for it and for the gaits added later.

    The HDF5 library crashes on a full disk (segmentation fault, version 1.14).

    Raises
    ------
    OSError
        If the disk has less room.
    """
    reserve(path, room)
    with h5py.File(path, "w"):
        pass  # in the order of names; h5netcdf would keep that of creation
    table.to_netcdf(path, mode="a", engine="h5netcdf")


def read_table(path: str | Path, kind: str, version: int, *, omit: Container[str] = ()) -> "xr.Dataset":
    """Read a table; groups in `omit` are not part of it.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind.
    """
    import xarray as xr

    with read_hdf5(path, kind, version, omit=omit):
        return xr.load_dataset(path, engine="h5netcdf")
