"""Basins along a branch in NetCDF files."""

from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.arguments import check_arguments
from gaitopt.motion.atomic import check_suffix, write_atomically
from gaitopt.motion.checksum import append_checksum
from gaitopt.motion.netcdf import write_netcdf
from gaitopt.study.basins.branch_basin import KIND, VERSION, check_branch_basin
from gaitopt.study.storage.netcdf_file import read_table

if TYPE_CHECKING:
    import xarray as xr


@check_arguments
def save_branch_basin(table: "xr.Dataset", path: str | Path) -> Path:
    """Write basins along a branch to a NetCDF file atomically.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.study.trace_basin`.
    path : str or Path
        Ends in ``.nc``.

    Raises
    ------
    InputError
        If the dataset is not that of basins along a branch, or the suffix differs.
    ArchiveError
        If the file is not writable or the disk is full.

    Examples
    --------
    >>> import math, tempfile
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> from gaitopt.stability.recovery import PushTest
    >>> from gaitopt.study import PushSearch, trace_basin
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.95)})
    >>> table = trace_basin(wheel, diagram, [1.0], balls=PushTest(starts=4), search=PushSearch(radii=3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_branch_basin(save_branch_basin(table, f"{folder}/basin.nc")).identical(table)
    True
    """
    path = Path(path)
    check_suffix(path, {".nc": "basins along a branch"})
    check_branch_basin(table)
    with write_atomically(path) as temporary:
        write_netcdf(table, temporary, table.nbytes + 100_000)
        append_checksum(temporary)
    return path


@check_arguments
def load_branch_basin(path: str | Path) -> "xr.Dataset":
    """Read basins along a branch from a file.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_branch_basin("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    return read_table(path, KIND, VERSION)
