"""Trial of a file without a checksum: another process reads all of it, within a time limit.

The HDF5 library may loop for ever or crash in a damaged file, and Ctrl-C does not reach it.
"""

import os
import subprocess
import sys
from pathlib import Path

import h5py

from gaitopt.errors import ArchiveError
from gaitopt.motion.file_structure import check_structure

TIME_LIMIT = 20.0
"""Time after which the other process is terminated [s]; reading a file takes a fraction of a second."""


def probe_file(path: Path) -> None:
    """Raise ArchiveError if the HDF5 library does not return from a file or crashes; other errors are left to it.

    Examples
    --------
    >>> probe_file(Path("docs/examples/compass_slip.h5"))
    """
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-P", "-m", "gaitopt.motion.file_probe", str(path.resolve())]
    try:
        status = subprocess.run(
            command, env=environment, timeout=TIME_LIMIT, check=False, stdin=subprocess.DEVNULL, capture_output=True
        ).returncode
    except subprocess.TimeoutExpired:
        raise ArchiveError(f"{path} is damaged: the HDF5 library does not finish reading it.") from None
    if status < 0 or status >= 0xC0000000:  # a signal, or an exception of Windows
        raise ArchiveError(f"{path} is damaged: the HDF5 library crashes while reading it.")


def read_all(path: str) -> None:
    """Read all attributes and datasets of a file.

    Raises
    ------
    ArchiveError
        If the structure of the file is rejected.
    """
    with h5py.File(path, "r") as file:
        check_structure(file)
        file.visititems(_read_object)
        _read_object("/", file)


def _read_object(_: str, item: h5py.HLObject) -> None:
    dict(item.attrs)
    if isinstance(item, h5py.Dataset):
        item[()]


if __name__ == "__main__":
    read_all(sys.argv[1])
