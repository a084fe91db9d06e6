"""Changes to files of gaitopt, after which their checksum is valid again."""

from contextlib import contextmanager
from pathlib import Path

import h5py

from gaitopt.motion.checksum import BLOCK, append_checksum, verify_checksum


def remove_checksum(path):
    """Remove the checksum of a file, if it has one."""
    path = Path(path)
    if verify_checksum(path):
        path.write_bytes(path.read_bytes()[:-BLOCK])


@contextmanager
def edit_hdf5(path):
    """Open a file to change it, and write its checksum again."""
    remove_checksum(path)
    with h5py.File(path, "a") as file:
        yield file
    append_checksum(Path(path))
