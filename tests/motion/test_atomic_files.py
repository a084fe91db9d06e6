"""Files are written whole or not at all."""

import os
import signal
import stat
import tempfile
from pathlib import Path

import pytest

from gaitopt import ArchiveError, InputError
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


def write(path, text="new"):
    with write_atomically(path) as temporary:
        temporary.write_text(text)


def test_a_symbolic_link_is_followed(tmp_path):
    (tmp_path / "data").mkdir()
    real, link = tmp_path / "data" / "note.txt", tmp_path / "link.txt"
    real.write_text("old")
    link.symlink_to(real)
    write(link)
    assert link.is_symlink()
    assert real.read_text() == "new"
    dangling = tmp_path / "dangling.txt"
    dangling.symlink_to(tmp_path / "data" / "later.txt")
    write(dangling)
    assert (tmp_path / "data" / "later.txt").read_text() == "new"
    assert names(tmp_path / "data") == ["later.txt", "note.txt"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_a_file_keeps_its_permissions(tmp_path, mode):
    path = tmp_path / "note.txt"
    path.write_text("old")
    path.chmod(mode)
    write(path)
    assert stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.parametrize("refuse", [check_writable, write])
def test_what_is_no_regular_file_or_must_stay_is_refused(tmp_path, refuse):
    pipe, locked, script, loop = (tmp_path / name for name in ("pipe", "locked.txt", "problem.py", "loop"))
    os.mkfifo(pipe)
    locked.write_text("old")
    locked.chmod(0o444)
    loop.symlink_to(loop)
    for path, message in {
        pipe: "it is a device, a pipe or a socket",
        Path(os.devnull): "it is a device, a pipe or a socket",
        locked: "the file is read-only",
        tmp_path: "it is a folder",
        loop: "symbolic links",
        tmp_path / "a\0b": "null",
        tmp_path / ("a" * 300): "File name too long",
    }.items():
        with pytest.raises(ArchiveError, match=message):
            refuse(path)
    with pytest.raises(InputError, match=r"'\.py' is that of a script"):
        refuse(script)
    assert names(tmp_path) == ["locked.txt", "loop", "pipe"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)


@pytest.mark.parametrize("write", [write_atomically, check_writable])
def test_an_interrupt_while_the_temporary_file_is_created_leaves_none(tmp_path, monkeypatch, write):
    make = tempfile.mkstemp

    def make_and_interrupt(**options):
        made = make(**options)
        signal.raise_signal(signal.SIGINT)
        return made

    monkeypatch.setattr(tempfile, "mkstemp", make_and_interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_and_enter(write, tmp_path / "result.txt")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [write_atomically, check_writable])
def test_an_interrupt_while_the_temporary_file_is_removed_leaves_none(tmp_path, monkeypatch, write):
    remove, calls = Path.unlink, []

    def interrupt_then_remove(path, **options):
        calls.append(path)
        if len(calls) == 1:
            signal.raise_signal(signal.SIGINT)
        remove(path, **options)

    monkeypatch.setattr(Path, "unlink", interrupt_then_remove)
    with pytest.raises(KeyboardInterrupt):
        write_and_enter(write, tmp_path / "result.txt", fail=True)
    assert [path.name for path in tmp_path.iterdir()] == []


def write_and_enter(write, path, fail=False):
    """Write a file, or check that it can be written; a write may fail."""
    if write is check_writable:
        return write(path)
    with write(path) as temporary:
        temporary.write_text("text")
        if fail:
            raise ValueError("fails")
    return None
