"""Two processes never compute one study at a time, and no file is replaced by one with fewer results."""

import os
import subprocess
import sys
import tempfile

import pytest
import xarray as xr

from gaitopt import (
    ArchiveError,
    Execution,
    GaitProblem,
    InputError,
    Limits,
    MultipleShooting,
    basin,
    compass_biped,
    load,
    load_sweep,
    rimless_wheel,
    search,
    sweep,
)
from gaitopt.study import Pareto
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.storage.study_lock import lock_study

HOLD = """
import sys
from pathlib import Path
from gaitopt.study.storage.study_lock import lock_study
with lock_study(Path(sys.argv[1])):
    print("locked", flush=True)
    sys.stdin.read()
"""
AXES = {"friction": [0.3, 0.31]}


@pytest.fixture
def hold():
    """Return a function that locks a study in another process, and ends that process afterwards."""
    running = []

    def start(path):
        process = subprocess.Popen(
            [sys.executable, "-c", HOLD, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        running.append(process)
        assert process.stdout.readline() == "locked\n"
        return process

    yield start
    for process in running:
        process.kill()
        process.communicate()


def problem():
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=8),
    )


def test_a_study_that_is_computed_by_another_process_is_refused(hold, tmp_path):
    process = hold(tmp_path / "study.nc")
    (tmp_path / "sequences").mkdir()
    other = hold(tmp_path / "sequences")
    with pytest.raises(ArchiveError, match=rf"study\.nc: its results are being computed by process {process.pid} on"):
        sweep(problem(), AXES, starts=1, path=tmp_path / "study.nc")
    with pytest.raises(ArchiveError, match=f"computed by process {process.pid}"):
        Pareto(points=2).trace(problem(), path=tmp_path / "study.nc")
    with pytest.raises(ArchiveError, match=f"computed by process {process.pid}"):
        basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1]}, path=tmp_path / "study.nc")
    with pytest.raises(ArchiveError, match=f"sequences: its results are being computed by process {other.pid}"):
        search(problem(), sequences=["stick | stick"], starts=1, directory=tmp_path / "sequences")
    assert not (tmp_path / "study.nc").exists()


def test_the_lock_of_a_killed_process_is_released(hold, tmp_path):
    process = hold(tmp_path / "study.nc")
    process.kill()
    process.wait()
    assert (tmp_path / "study.nc.lock").exists()
    with lock_study(tmp_path / "study.nc"):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="Windows does not remove an open file")
def test_a_lock_file_that_is_removed_while_it_is_acquired_is_created_again(tmp_path, monkeypatch):
    from gaitopt.study.storage import study_lock

    lock, calls = study_lock._lock, []

    def remove_first(handle):
        if not calls:
            (tmp_path / "study.nc.lock").unlink()
        calls.append(handle)
        lock(handle)

    monkeypatch.setattr(study_lock, "_lock", remove_first)
    with lock_study(tmp_path / "study.nc"):
        assert (tmp_path / "study.nc.lock").exists()
    assert len(calls) == 2


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(ArchiveError, match=r"nowhere.*No such file or directory"), lock_study(tmp_path / "nowhere/x"):
        pass


def test_a_sweep_that_another_process_has_finished_is_not_computed_again(tmp_path, monkeypatch):
    """The file appears between the first look and the lock."""
    from gaitopt.study.sweeps import sweep as module

    path = tmp_path / "study.nc"
    whole, calls = sweep(problem(), AXES, starts=1, path=path), []
    finished, read = path.read_bytes(), module.read_stored_sweep
    path.unlink()

    def appear(*arguments):
        table = read(*arguments)
        if not path.exists():
            path.write_bytes(finished)
        return table

    monkeypatch.setattr(module, "read_stored_sweep", appear)
    observed = Execution(observer=lambda done, total: calls.append(done))
    assert sweep(problem(), AXES, starts=1, path=path, execution=observed).identical(whole)
    assert not calls
    assert path.read_bytes() == finished


def test_a_front_that_another_process_has_finished_is_not_computed_again(tmp_path, monkeypatch):
    from gaitopt.study.trade_offs import pareto as module

    finished = xr.Dataset(attrs={"complete": True})
    looks = iter([None, finished])
    monkeypatch.setattr(module, "_read_complete", lambda path, key: next(looks))
    assert Pareto(points=2).trace(problem(), path=tmp_path / "front.nc") is finished
    assert not list(tmp_path.iterdir())


def test_a_file_is_not_replaced_by_one_with_fewer_points(tmp_path):
    """The parts of an interrupted sweep are lost, and the sweep is interrupted again earlier."""
    path, parts = tmp_path / "study.nc", GaitStore.beside(tmp_path / "study.nc")

    def stop_at(count):
        def observe(done, total):
            if done == count:
                raise KeyboardInterrupt

        return Execution(observer=observe)

    total = []
    sweep(problem(), AXES, starts=1, execution=Execution(observer=lambda done, all_: total.append(all_)))
    first = sweep(problem(), AXES, starts=1, path=path, execution=stop_at(total[0] - 1))
    assert (first.status == "pending").sum() == 1
    for file in parts.iterdir():
        file.unlink()
    again = sweep(problem(), AXES, starts=1, path=path, execution=stop_at(1))
    assert again.identical(first)
    assert load_sweep(path).identical(first)


def test_temporary_files_of_a_killed_writer_are_removed(tmp_path):
    parts = tmp_path / "front.nc.parts"
    parts.mkdir()
    abandoned = [tmp_path / ".front-a1b2c3_4.nc", parts / ".point-0-a1b2c3d4.h5"]
    others = [tmp_path / ".fronts-a1b2c3d4.nc", tmp_path / ".front-a.nc", parts / "point-0.h5", tmp_path / "front.nc"]
    others.append(parts / ".docker-override.yml")  # of the user
    for file in (*abandoned, *others):
        file.touch()
    with lock_study(tmp_path / "front.nc"):
        assert not any(file.exists() for file in abandoned)
    assert all(file.exists() for file in others)


@pytest.mark.skipif(os.name != "posix", reason="Windows removes no folder of another process")
def test_folders_of_workers_of_a_killed_process_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = tmp_path / "gaitopt-a1b2c3d4"
    folder.mkdir()
    (folder / "owner.lock").touch()
    with lock_study(tmp_path / "front.nc"):
        assert not folder.exists()


def test_a_folder_without_results_is_used_by_another_study_unless_one_is_computed(tmp_path):
    GaitStore(tmp_path / "study", {"starts": 1})
    store = GaitStore(tmp_path / "study", {"starts": 2})
    with lock_study(store.path), pytest.raises(InputError, match="different starts"):
        GaitStore(store.path, {"starts": 3})
    store["gait"] = load("docs/examples/compass_slip.h5")
    with pytest.raises(InputError, match="different starts"):
        GaitStore(store.path, {"starts": 3})
