"""The message after Ctrl-C: which results are stored, and that the same command resumes."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gaitopt import basin, load, rimless_wheel, save
from gaitopt.cli import pareto_command, stored_results
from gaitopt.cli.progress_display import Display
from gaitopt.continuation import checkpoint
from gaitopt.study.basins.basin_file import save_basin
from gaitopt.study.storage import gait_store

QUICK = """\
from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped


def problem(friction=0.16):
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=friction, speed=0.633, step_length=0.4713,
        limits=Limits(torque=6), objective="torque_squared", transcription=MultipleShooting(intervals=10),
    )
"""
INTERRUPTED_STUDY = """\
from matplotlib.figure import Figure


class Late(Figure):
    def savefig(self, *_, **__):
        raise KeyboardInterrupt


def study():
    return {"first": Figure(), "second": Late()}
"""
RESUME = "Run the same command again to resume."
SOLVERS = {
    "sweep": ("gaitopt.study.sweeps.sweep.solve_task", ("--over", "friction=0.14,0.16"), "f.nc.parts"),
    "pareto": ("gaitopt.study.trade_offs.pareto.solve_front_task", ("--points", "2"), "f.nc.parts"),
    "search": ("gaitopt.study.sequence_search.search.solve_sequence", ("--max-phases", "1"), "f.nc"),
}
"""Function that does a task of each study, options, and the folder of the gaits."""


def interrupt_at(monkeypatch, place, call, gait):
    """Replace the tasks of a study by a function that returns a gait and is interrupted at one of its calls."""
    calls = []

    def run(*_):
        calls.append(None)
        if len(calls) == call:
            raise KeyboardInterrupt
        return gait

    monkeypatch.setattr(place, run)


@pytest.mark.parametrize("command_name", SOLVERS)
def test_an_interrupted_study_states_what_is_stored(command, script, folder, monkeypatch, slip_file, command_name):
    place, options, parts = SOLVERS[command_name]
    arguments = (command_name, script(QUICK), *options, "--starts", "1", "--workers", "1", "-o", "f.nc")
    gait = load(slip_file)
    interrupt_at(monkeypatch, place, 1, gait)
    first = command(*arguments)
    assert (first.status, first.out.strip()) == (130, "")
    note = f"Interrupted; no result was written. {parts} contains the settings of the study and no result."
    assert " ".join(first.err.split()).endswith(note)
    interrupt_at(monkeypatch, place, 2, gait)
    second = command(*arguments)
    interrupt_at(monkeypatch, place, 1, gait)  # before a further result
    third = command(*arguments, "--json")
    stored = list((folder / parts).glob("*.h5"))
    assert len(stored) == 1
    for run in (second, third):
        text = " ".join(run.err.split())
        assert run.status == 130
        assert "1 optimisation (0 finished" in text
        assert f"is kept in {parts}. {RESUME}" in text
        assert "no result" not in text
    assert third.json["error"] in third.err


def test_a_gait_that_is_not_measured_is_no_computed_point_of_a_front():
    table = xr.Dataset(
        {"cost": ("point", [1.0, 2.0, np.nan, np.nan]), "spectral_radius": ("point", [0.7, np.nan, np.nan, np.nan])},
        attrs={"objectives": ["cost", "spectral_radius"]},
    )
    table["status"] = ("point", np.array(["solved", "solved", "infeasible", "pending"], dtype=object))
    assert pareto_command._describe_progress(table) == "2 of 4 points"


def test_an_incomplete_front_states_in_one_sentence_what_is_computed(folder, slip_file, capsys, monkeypatch):
    (folder / "f.nc.parts").mkdir()
    save(load(slip_file), folder / "f.nc.parts/cold-1.h5")
    monkeypatch.setattr(pareto_command, "print_front", lambda table: None)
    table = xr.Dataset({"cost": ("point", [np.nan] * 2)}, attrs={"objectives": ["cost"], "complete": 0})
    table["status"] = ("point", np.array(["pending"] * 2, dtype=object))
    with pytest.raises(SystemExit, match="130"):
        pareto_command._report(table, {"file": Path("f.nc"), "figure": Path("f.png")}, json=False, seconds=1.0)
    printed = capsys.readouterr()
    assert printed.out == "wrote f.png\n"
    assert printed.err == (
        "Incomplete: 0 of 2 points are written to f.nc, and 1 optimisation (0 finished points) is kept in f.nc.parts. "
        f"{RESUME}\n"
    )


def test_finished_points_are_counted(folder, slip_file):
    parts = folder / "f.nc.parts"
    parts.mkdir()
    for name in ("cold-1", "point-1", "point-2", ".point-3"):
        save(load(slip_file), parts / f"{name}.h5")
    text = stored_results.describe_stored_results("sweep", folder / "f.nc")
    assert text == f"3 optimisations (2 finished points) are kept in {parts}."


def test_an_interrupted_basin_states_its_starts(folder):
    rates = [0.1, 2.0, 4.0]
    basin(rimless_wheel(), {"slope": math.radians(13)}, {"theta_rate": rates}, path=folder / "basin.nc")
    text = stored_results.describe_stored_results("basin", folder / "basin.nc")
    assert text == f"3 of 3 starts are kept in {folder / 'basin.nc'}."


def test_stored_starts_are_counted_after_an_interrupted_import(folder, monkeypatch):
    table = basin(rimless_wheel(), {"slope": math.radians(13)}, {"theta_rate": [0.1, 2.0, 4.0]})
    ending = table.ending.copy()
    ending[1] = -1  # pending
    save_basin(table.assign(ending=ending).assign_attrs(complete=0), folder / "basin.nc")
    monkeypatch.setitem(sys.modules, "xarray", None)
    text = stored_results.describe_stored_results("basin", folder / "basin.nc")
    assert text == f"2 of 3 starts are kept in {folder / 'basin.nc'}."


def test_an_incomplete_basin_states_in_one_sentence_what_is_computed(command, root, monkeypatch):
    def stop(display, done, total, note=""):
        raise KeyboardInterrupt

    monkeypatch.setattr(Display, "count", stop)
    monkeypatch.setattr("gaitopt.study.basins.basin.CHUNK", 2)
    arguments = ("--over", "theta_rate=1,2,3", "--workers", "1", "-o", "basin.nc")
    run = command("basin", root / "problems/rimless_wheel.py", *arguments)
    assert run.status == 130
    assert run.err.splitlines()[-1] == f"Incomplete: 2 of 3 starts are kept in basin.nc. {RESUME}"
    assert "wrote" not in run.out


@pytest.mark.parametrize("verb", ["basin", "audit"])
def test_a_file_of_another_kind_has_no_stored_results(folder, slip_file, verb):
    assert stored_results.describe_stored_results(verb, slip_file) == ""


def test_an_interrupted_basin_without_a_file_wrote_nothing(command, root, monkeypatch):
    interrupt_at(monkeypatch, "gaitopt.study.basins.basin.walk_starts", 1, None)
    run = command("basin", root / "problems/rimless_wheel.py", "--over", "theta_rate=1,2", "--workers", "1")
    assert (run.status, run.err.strip().splitlines()[-1]) == (130, "Interrupted; no result was written.")


@pytest.mark.parametrize(("steps", "kept"), [(0, ""), (1, "1 corrector step is"), (7, "7 corrector steps are")])
def test_the_corrector_steps_of_a_trace_are_counted(tmp_path, steps, kept):
    path = tmp_path / f"branch.nc{checkpoint.SUFFIX}"
    path.write_text("{}\n" * (1 + steps) + "{")  # the last line was being written
    text = stored_results.describe_stored_results("trace", tmp_path / "branch.nc")
    assert text == (f"{kept} kept in {path}." if kept else "")


def test_the_files_written_before_an_interrupt_are_named(command, folder, script):
    run = command("run", script(INTERRUPTED_STUDY))
    assert (run.status, run.err.strip().splitlines()[-1]) == (130, "Interrupted; wrote own_first.png.")
    assert (folder / "own_first.png").exists()


def test_the_names_of_the_stored_files_agree():
    assert (gait_store.QUESTION, checkpoint.SUFFIX) == (stored_results.QUESTION, stored_results.SUFFIX)
    assert set(stored_results._DESCRIPTIONS) == {"sweep", "pareto", "search", "basin", "trace", "audit"}


def test_a_trace_interrupted_before_its_first_corrector_step_is_resumed_by_the_same_command(tmp_path):
    path = tmp_path / f"branch.nc{checkpoint.SUFFIX}"
    path.write_text("{}\n")
    invocation = stored_results.Invocation("trace", tmp_path / "branch.nc")
    assert stored_results.describe_interrupt(invocation, [path]) == (
        f"Interrupted; no result was written. {path} contains the settings of the trace and no corrector step yet. "
        "Run the same command again to resume."
    )
    path.unlink()
    assert stored_results.describe_interrupt(invocation, [path]) == "Interrupted; no result was written."
