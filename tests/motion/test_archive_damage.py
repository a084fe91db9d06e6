"""Gait files that cannot be read or written: the mistake is named, and nothing that was there is lost."""

import dataclasses
import shutil

import h5py
import numpy as np
import pytest

from gaitopt import ArchiveError, InputError, load, save
from gaitopt.motion import archive, hdf5
from tests.hdf5 import edit_hdf5


@pytest.fixture
def path(slip_gait, tmp_path):
    return save(slip_gait, tmp_path / "gait.h5")


def fails(path, expected):
    with pytest.raises(ArchiveError) as caught:
        load(path)
    message = str(caught.value)
    assert str(path) in message
    assert expected in message


def test_missing_file(tmp_path):
    fails(tmp_path / "none.h5", "There is no file")
    fails(tmp_path, "is a folder; specify a file.")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9, 0.999])
def test_truncated_file(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    fails(path, "not a readable HDF5 file")


def test_random_bytes(path, rng):
    path.write_bytes(rng.bytes(20_000))
    fails(path, "not a readable HDF5 file")


def test_text_file(path):
    path.write_text("this is not a gait\n" * 100)
    fails(path, "not a readable HDF5 file")


@pytest.mark.parametrize("error", [RuntimeError, OSError, ValueError, AttributeError])
def test_whatever_hdf5_raises_inside_a_damaged_file(path, monkeypatch, error):
    """Flipped bytes make h5py raise any of these, according to where they are."""

    def damaged(file):
        raise error("Error iterating over attributes")

    monkeypatch.setattr(archive, "read_gait", damaged)
    fails(path, "damaged")


def test_a_file_of_another_study_says_what_reads_it(path):
    with edit_hdf5(path) as file:
        file.attrs["format"] = "gaitopt basin"
    fails(
        path,
        "contains a basin, not a gait; 'gaitopt show' and 'gaitopt plot' accept it, "
        "and in Python, load_basin reads it.",
    )


def test_hdf5_of_another_kind(tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.zeros(3)
    fails(tmp_path / "other.h5", "not a gait written by gaitopt")


def test_format_attribute_of_something_else(path):
    with edit_hdf5(path) as file:
        file.attrs["format"] = "another format"
    fails(path, "not a gait written by gaitopt")


def test_newer_version(path):
    with edit_hdf5(path) as file:
        file.attrs["format_version"] = archive.VERSION + 1
    fails(path, f"format version {archive.VERSION + 1}; this gaitopt reads up to {archive.VERSION}. Upgrade")


@pytest.mark.parametrize(
    "name",
    [
        "solution/unknowns",
        "solver",
        "versions",
        "motion",
        "motion/segments",
        "motion/segments/0001/torque",
        "motion/jumps/0000/q",
    ],
)
def test_missing_part(path, name):
    with edit_hdf5(path) as file:
        del file[name]
    fails(path, "damaged")


@pytest.mark.parametrize(
    ("group", "attribute", "value"),
    [
        ("/", "sequence", "stick | slide"),
        ("/", "sequence", "stick stick | stick"),
        ("/", "status", "splendid"),
        ("/", "problem", "{not json"),
        ("/", "format_version", "two"),
        ("motion/segments/0000", "mode", "hop"),
        ("motion/segments/0000", "step", "first"),
        ("solver", "violations", '[{"place": "x"}]'),
        ("solver", "surprise", 1.0),
        ("motion", "links", "[1, 2]"),
        ("motion", "total_mass", "heavy"),
    ],
)
def test_attribute_that_makes_no_sense(path, group, attribute, value):
    with edit_hdf5(path) as file:
        file[group].attrs[attribute] = value
    fails(path, "damaged")


def test_dataset_of_text(path):
    with edit_hdf5(path) as file:
        del file["motion/segments/0000/q"]
        file["motion/segments/0000/q"] = ["a", "b"]
    fails(path, "damaged")


def test_a_folder_that_does_not_exist(slip_gait, tmp_path):
    with pytest.raises(ArchiveError, match=r"the folder .*nowhere does not exist\. Create it"):
        save(slip_gait, tmp_path / "nowhere" / "gait.h5")


def test_a_target_that_is_a_folder(slip_gait, tmp_path):
    with pytest.raises(ArchiveError, match=r"it is a folder\. Specify a file name"):
        save(slip_gait, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["gait.mat", "gait.csv", "gait", "gait.h5.txt"])
def test_another_suffix_is_refused_and_what_writes_it_is_named(slip_gait, tmp_path, name):
    with pytest.raises(
        InputError, match=r"Cannot write .*Use \.h5 \(HDF5\), \.hdf5 \(HDF5\)\. .*gaitopt export.*write_csv"
    ):
        save(slip_gait, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["gait.h5", "gait.hdf5", "gait.H5"])
def test_suffixes_of_gait_files(slip_gait, tmp_path, name):
    assert load(save(slip_gait, tmp_path / name)).sequence == slip_gait.sequence


def test_a_folder_that_cannot_be_written(slip_gait, monkeypatch, tmp_path):
    def refuse(**options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkstemp", refuse)
    with pytest.raises(ArchiveError, match=r"not writable \(Permission denied\)"):
        save(slip_gait, tmp_path / "gait.h5")


class Interrupt(BaseException):
    """Stands for Ctrl-C."""


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("h5py"), Interrupt()])
def test_a_failure_in_the_middle_leaves_the_old_file_and_nothing_else(slip_gait, path, monkeypatch, error):
    before = path.read_bytes()

    def fail(group, motion):
        raise error

    monkeypatch.setattr(archive, "write_motion", fail)
    other = dataclasses.replace(slip_gait, robot=dataclasses.replace(slip_gait.robot, name="another"))
    with pytest.raises(ArchiveError if isinstance(error, OSError) else type(error)) as caught:
        save(other, path)
    assert path.read_bytes() == before
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]
    if isinstance(error, OSError):
        assert "No space left on device" in str(caught.value)


def test_a_file_is_replaced_as_a_whole(slip_gait, path):
    with edit_hdf5(path) as file:
        file["left over"] = 1.0
    shutil.copy(path, path.with_name("copy.h5"))
    save(dataclasses.replace(slip_gait, robot=dataclasses.replace(slip_gait.robot, name="another")), path)
    with h5py.File(path, "r") as file:
        assert "left over" not in file
    assert load(path).robot_name == "another"
    assert sorted(entry.name for entry in path.parent.iterdir()) == ["copy.h5", "gait.h5"]


def test_an_interrupt_that_the_library_reports_as_an_error_is_no_damage(path, monkeypatch):
    """The lock of h5py, interrupted, raises a SystemError."""

    def interrupt(*arguments, **options):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(hdf5, "check_structure", interrupt)
    with pytest.raises(KeyboardInterrupt):
        load(path)
