"""Files are written whole or not at all."""

import os
import stat
from pathlib import Path

import pytest

from gaitopt import ArchiveError
from gaitopt.motion.atomic import check_writable, write_atomically


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_the_new_file_takes_the_place_of_the_old_one(tmp_path):
    path = tmp_path / "note.txt"
    path.write_text("old")
    with write_atomically(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent  # a rename is atomic only within a file system
        assert temporary.suffix == ".txt"
        written = temporary.stat().st_ino
    assert path.read_text() == "new"
    assert path.stat().st_ino == written  # renamed, not copied: never half there
    assert names(tmp_path) == ["note.txt"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_the_old_file_and_no_temporary(tmp_path, error):
    path = tmp_path / "note.txt"
    path.write_text("old")

    def half():
        with write_atomically(path) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        half()
    assert path.read_text() == "old"
    assert names(tmp_path) == ["note.txt"]


def test_an_operating_system_error_is_an_archive_error(tmp_path):
    def full():
        with write_atomically(tmp_path / "note.txt"):
            raise OSError(28, "No space left on device")

    with pytest.raises(ArchiveError, match=r"Cannot write .*note\.txt: No space left on device"):
        full()
    assert names(tmp_path) == []


def test_a_target_is_checked_before_any_work_and_left_alone(tmp_path):
    path = tmp_path / "note.txt"
    path.write_text("old")
    check_writable(path)
    assert path.read_text() == "old"
    assert names(tmp_path) == ["note.txt"]
    check_writable(tmp_path / "new.txt")
    assert names(tmp_path) == ["note.txt"]
    with pytest.raises(ArchiveError, match="does not exist"):
        check_writable(tmp_path / "nowhere" / "note.txt")
    with pytest.raises(ArchiveError, match="does not exist"):
        check_writable(path / "note.txt")  # its folder is a file


def test_a_file_reaches_the_disk_before_its_name_and_the_folder_after(tmp_path, monkeypatch):
    order, sync, rename = [], os.fsync, Path.replace

    def fsync(handle):
        order.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else f"{os.fstat(handle).st_size} bytes")
        sync(handle)

    def replace(self, target):
        order.append("renamed")
        return rename(self, target)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "replace", replace)
    with write_atomically(tmp_path / "note.txt") as temporary:
        temporary.write_text("whole")
    assert order == ["5 bytes", "renamed", "folder"]
