"""Files prove that they are intact before the HDF5 library reads them, and refer to no other file."""

import shutil
import sys
import time

import h5py
import numpy as np
import pytest

from gaitopt import ArchiveError, load, save
from gaitopt.motion import file_probe, hdf5
from gaitopt.motion.checksum import BLOCK, append_checksum, verify_checksum
from tests.hdf5 import edit_hdf5, remove_checksum


@pytest.fixture
def path(slip_gait, tmp_path):
    return save(slip_gait, tmp_path / "gait.h5")


@pytest.fixture
def old(tmp_path, request):
    """Return a gait file of version 2, which has no checksum."""
    return shutil.copy(request.config.rootpath / "tests/motion/compass_slip_version_2.h5", tmp_path / "old.h5")


def test_other_readers_ignore_the_checksum(path):
    assert verify_checksum(path)
    assert path.read_bytes()[-BLOCK:].rstrip().startswith(b"gaitopt sha256 ")
    with h5py.File(path, "r") as file:
        assert file.attrs["format"] == "gaitopt gait"
        assert file["motion/segments/0000/q"].shape[0] == 4


def test_every_flipped_bit_is_detected_before_the_library_opens_the_file(path, monkeypatch, rng):
    content = path.read_bytes()

    def refuse(*arguments, **options):
        raise AssertionError("the HDF5 library was used")

    monkeypatch.setattr(h5py, "File", refuse)
    for place in [*rng.integers(0, len(content), 100), *range(len(content) - BLOCK, len(content), 40)]:
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(ArchiveError, match="not a readable HDF5 file"):
            load(path)


def test_a_file_that_another_program_changed_is_refused(path):
    with h5py.File(path, "a") as file:
        file.attrs["status"] = "infeasible"
    with pytest.raises(ArchiveError, match=r"not a readable HDF5 file|has no checksum"):
        load(path)
    remove_checksum(save(load("docs/examples/compass_slip.h5"), path))
    with pytest.raises(ArchiveError, match=r"has no checksum: it is damaged, or another program has changed it"):
        load(path)


def test_a_file_of_an_earlier_version_is_tried_in_another_process(old, monkeypatch):
    assert load(old).status.ok
    monkeypatch.setattr(hdf5, "probe_file", lambda path: (_ for _ in ()).throw(ArchiveError("tried")))
    with pytest.raises(ArchiveError, match="tried"):
        load(old)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import time; time.sleep(60)", "does not finish reading it"),
        ("import os; os.abort()", "crashes while reading it"),
    ],
)
def test_a_library_that_hangs_or_crashes_is_reported(old, tmp_path, monkeypatch, code, message):
    (tmp_path / "gaitopt").mkdir()
    (tmp_path / "gaitopt" / "__init__.py").touch()
    (tmp_path / "gaitopt" / "motion").mkdir()
    (tmp_path / "gaitopt" / "motion" / "__init__.py").touch()
    (tmp_path / "gaitopt" / "motion" / "file_probe.py").write_text(code)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(file_probe, "TIME_LIMIT", 1.0)
    with pytest.raises(ArchiveError, match=message):
        load(old)


def test_a_large_file_is_checked_again_only_after_a_change(path, monkeypatch):
    monkeypatch.setattr(hdf5, "_CACHED_SIZE", 0)
    checked, verify = [], hdf5.verify_checksum
    monkeypatch.setattr(hdf5, "verify_checksum", lambda path: checked.append(path) or verify(path))
    load(path)
    load(path)
    assert len(checked) == 1
    content = bytearray(path.read_bytes())
    content[1000] ^= 1
    time.sleep(0.02)  # times of files have a resolution of some milliseconds
    path.write_bytes(content)
    with pytest.raises(ArchiveError, match="checksum"):
        load(path)


def external(file, folder):
    (folder / "secret").write_bytes(b"12345678")
    del file["motion/segments/0000/time"]
    file.create_dataset("motion/segments/0000/time", (1,), float, external=[(str(folder / "secret"), 0, 8)])


def virtual(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = np.zeros(3)
    layout = h5py.VirtualLayout((3,), float)
    layout[:] = h5py.VirtualSource(folder / "other.h5", "x", (3,))
    del file["motion/segments/0000/time"]
    file.create_virtual_dataset("motion/segments/0000/time", layout)


def link(file, folder):
    del file["motion/jumps"]
    file["motion/jumps"] = h5py.ExternalLink(str(folder / "other.h5"), "/")


def soft_link(file, folder):
    del file["motion/jumps"]
    file["motion/jumps"] = h5py.SoftLink("/motion/segments")


def gigantic(file, folder):
    del file["motion/segments/0000/time"]
    file.create_dataset("motion/segments/0000/time", (10**12,), float, chunks=(1000,))


def datatype(file, folder):
    file["motion/type"] = np.dtype(float)


def cycle(file, folder):
    file["motion/segments/0000/again"] = file["motion"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (external, "the data of /motion/segments/0000/time is in another file"),
        (virtual, "the data of /motion/segments/0000/time is in another file"),
        (link, "/motion/jumps is a link to another place or file"),
        (soft_link, "/motion/jumps is a link to another place or file"),
        (gigantic, r"declares more than 1\d\d MB of data; /motion/segments/0000/time has the shape \(1000000000000,\)"),
        (datatype, "/motion/type is neither a group nor a dataset"),
    ],
)
def test_data_elsewhere_and_implausible_sizes_are_refused(path, change, message):
    with edit_hdf5(path) as file:
        change(file, path.parent)
    with pytest.raises(ArchiveError, match=message):
        load(path)


def test_a_group_in_itself_does_not_hang(path):
    with edit_hdf5(path) as file:
        cycle(file, path.parent)
    assert load(path).status.ok


def test_a_pipe_is_not_opened(tmp_path):
    import os

    os.mkfifo(tmp_path / "pipe.h5")
    with pytest.raises(ArchiveError, match="is a device, a pipe or a socket"):
        load(tmp_path / "pipe.h5")


def test_the_checksum_of_a_long_file(tmp_path):
    path = tmp_path / "long.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(500_000)
    append_checksum(path)
    assert verify_checksum(path)
