"""NetCDF files of labelled tables: written and loaded as a whole, with a Ctrl-C deferred.

A file that h5netcdf opens has a finaliser, which fails with a message if Ctrl-C has ended its constructor.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import h5py

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.atomic import reserve

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(table: "xr.Dataset", path: Path, room: int) -> None:
    """Write a table to a new file after reserving `room` bytes on the disk.

    The HDF5 library crashes on a full disk (segmentation fault, version 1.14).

    Raises
    ------
    OSError
        If the disk has less room.
    """
    reserve(path, room)
    with defer_interrupt():
        with h5py.File(path, "w"):
            pass  # in the order of names; h5netcdf would keep that of creation
        table.to_netcdf(path, mode="a", engine="h5netcdf")


def load_netcdf(path: str | Path) -> "xr.Dataset":
    """Return the table of a file, which is then closed."""
    import xarray as xr

    with defer_interrupt():
        return xr.load_dataset(path, engine="h5netcdf")
