"""Labelled tables in NetCDF files: read only if they are of the expected kind."""

import contextlib
import importlib
from collections.abc import Callable, Container
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.motion.netcdf import load_netcdf

if TYPE_CHECKING:
    import xarray as xr

FOR_TABLES, FOR_FILES = ("pandas", "xarray", "dask", "dask.array"), ("h5netcdf", "distributed")
"""Packages that xarray imports for a table and for its file; dask and distributed are optional."""


def import_packages(path: Path | None, check: Callable[[], None]) -> None:
    """Import the packages that a table and its file, if there is one, need; `check` is called before each of them.

    A study imports them while its workers run, so that an interrupt does not wait for the import.  A thread must not
    import them: packages with circular imports fail if two threads import them.
    """
    for name in FOR_TABLES if path is None else FOR_TABLES + FOR_FILES:
        check()
        with contextlib.suppress(ImportError):  # reported when the table is made
            importlib.import_module(name)


def read_table(path: str | Path, kind: str, version: int, *, omit: Container[str] = ()) -> "xr.Dataset":
    """Read a table; groups in `omit` are not part of it.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind.
    """
    with read_hdf5(path, kind, version, omit=omit):
        return load_netcdf(path)
