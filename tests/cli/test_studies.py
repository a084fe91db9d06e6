"""The commands on many gaits."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread

from gaitopt import load, load_sweep, save
from gaitopt.cli import study_output
from gaitopt.cli.progress_display import Display
from gaitopt.plot.saving import DOTS_PER_INCH

QUICK = """\
from gaitopt import GaitProblem, Limits, MultipleShooting, TorqueSquared, compass_biped


class Own(TorqueSquared):
    name = "own"


def problem(friction=0.16, intervals=10):
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=friction, speed=0.633, step_length=0.4713,
        limits=Limits(torque=6), objective=Own(), transcription=MultipleShooting(intervals=intervals),
    )
"""


@pytest.fixture
def quick(script):
    return script(QUICK)


@pytest.mark.slow
def test_sweep_prints_a_table_and_goes_on(command, quick, folder):
    arguments = ("sweep", quick, "--over", "friction=0.14:0.18:2", "--starts", "1", "--workers", "1", "-o", "f.nc")
    ran = command(*arguments)
    assert ran.status == 0, ran.err
    assert "stick | stick" in ran.out
    assert "wrote f.nc" in ran.out
    table = load_sweep(folder / "f.nc")
    again = command(*arguments, "--json").json
    assert again["complete"]
    assert again["objective"] == table.objective.attrs["name"]
    assert all(point["objective"] > 0 for point in again["points"])
    assert [point["friction"] for point in again["points"]] == table.friction.values.tolist()
    assert all(point["status"] == "solved" and point["verified"] for point in again["points"])
    assert command(*arguments, "--set", "intervals=12").status == 2


@pytest.mark.slow
def test_sweep_in_processes_knows_the_classes_of_a_script(command, quick):
    """An objective of the script's own reaches the workers."""
    ran = command("sweep", quick, "--over", "friction=0.14,0.18", "--starts", "1", "--workers", "2", "-o", "f.nc")
    assert ran.status == 0, ran.err


def test_sweep_refuses_what_cannot_be(command, quick):
    assert "twice" in command("sweep", quick, "--over", "friction=1:2:2", "--over", "friction=1:2:2", "-o", "f.nc").err
    assert "leg_mass" in command("sweep", quick, "--over", "leg_mas=1:2:2", "-o", "f.nc").err
    assert "NAME=FROM:TO:COUNT" in command("sweep", quick, "--over", "friction", "-o", "f.nc").err
    wide = command("sweep", quick, "--over", "friction=1:2:1000", "--over", "speed=1:2:1000", "-o", "f.nc")
    assert "must define at most 100000 points, got 1000000" in wide.err
    assert "does not exist" in command("sweep", quick, "--over", "friction=0.1:0.2:2", "-o", "none/f.nc").err


def test_an_interrupted_search_reports_the_candidates_found_so_far(command, quick, folder, monkeypatch):
    counted, show = [], Display.count

    def stop(display, done, total, remark=""):
        show(display, done, total, remark)
        counted.append(display.line)
        if done == stop.last:
            raise KeyboardInterrupt

    stop.last = 1
    monkeypatch.setattr(Display, "count", stop)
    arguments = ("search", quick, "--max-phases", "1", "--starts", "1", "--workers", "1", "-o", "found")
    first = command(*arguments)
    assert first.status == 130
    assert counted == ["search 1/6 optimisations (0 of 3 sequences finished)"]
    assert first.err.startswith("search of 5 contact sequences of at most 1 phase\n")
    assert re.search(r"stick \| stick +pending +first solve: own \S+, neither replayed nor", first.out)
    assert "Incomplete: 1 optimisation (0 finished contact sequences) is kept in found. Run the same" in first.err
    monkeypatch.setattr("gaitopt.study.sequence_search.search.solve_sequence", raise_interrupt)
    again = command(*arguments, "--json")  # before the next result
    assert again.status == 130
    assert again.json["complete"] is False
    row = again.json["ranked"][0]
    assert (row["sequence"], row["status"]) == ("stick | stick", "pending")
    assert row["cost"] > 0
    written = json.loads((folder / "found/ranking.json").read_text())
    assert written == {"ranked": again.json["ranked"], "complete": False}


@pytest.mark.slow
def test_a_sweep_interrupted_before_its_first_result_begins_again_with_any_settings(
    command, quick, folder, monkeypatch
):
    arguments = ("sweep", quick, "--starts", "1", "--workers", "1", "-o", "f.nc")
    with monkeypatch.context() as patch:
        patch.setattr("gaitopt.study.sweeps.sweep.solve_task", raise_interrupt)
        first = command(*arguments, "--over", "friction=0.14:0.18:2")
    assert (first.status, first.out.strip()) == (130, "")
    assert "f.nc.parts contains the settings of the study and no result." in " ".join(first.err.split())
    other = command(*arguments, "--over", "friction=0.16", "--json")
    assert other.status == 0, other.err
    assert other.json["complete"]
    assert sorted(path.name for path in folder.iterdir() if path.name.startswith("f.nc")) == ["f.nc"]


def test_an_incomplete_sweep_states_in_one_sentence_what_is_computed(command, quick, monkeypatch):
    def stop(display, done, total):
        raise KeyboardInterrupt

    monkeypatch.setattr(Display, "count", stop)
    over = ("--over", "friction=0.14:0.18:30")
    run = command("sweep", quick, *over, "--starts", "1", "--workers", "1", "-o", "f.nc")
    assert run.status == 130
    assert run.out.strip() == ""
    assert run.err.splitlines()[-1] == (
        "Incomplete: 0 of 30 points are written to f.nc, and 1 optimisation (0 finished points) is kept in f.nc.parts. "
        "Run the same command again to resume."
    )


def raise_interrupt(*_):
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_sweep_keeps_what_is_done_and_says_so(number, quick, folder):
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "gaitopt",
            "sweep",
            quick,
            "--over",
            "friction=0.1:0.2:200",
            "--starts",
            "1",
            "-o",
            "f.nc",
        ],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        deadline = time.monotonic() + 240
        while len(list(folder.glob("f.nc.parts/cold*.h5"))) < 2:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        _, err = process.communicate(timeout=240)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert "nothing was written" not in err
    assert "Traceback" not in err
    assert "leaked" not in err  # the warning of loky about the semaphores of workers that are not shut down
    kept = len(list(folder.glob("f.nc.parts/*.h5")))
    assert f"Incomplete: 0 of 200 points are written to f.nc, and {kept} optimisations (0 finished points) are " in err
    assert "are kept in f.nc.parts. Run the same command again to resume." in err
    assert not load_sweep(folder / "f.nc").attrs["complete"]


@pytest.mark.slow
def test_repeated_interrupts_of_a_sweep_leave_no_semaphores(quick, folder):
    """As from a key that is held: every 30 ms, from when the workers compute."""
    words = ["sweep", quick, "--over", "friction=0.1:0.2:200", "--starts", "1", "--workers", "2", "-o", "f.nc"]
    process = subprocess.Popen(
        [sys.executable, "-m", "gaitopt", *map(str, words)], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        deadline = time.monotonic() + 240
        while not list(folder.glob("f.nc.parts/cold*.h5")):
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        while process.poll() is None and time.monotonic() < deadline:
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.03)
        _, err = process.communicate(timeout=240)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert "leaked" not in err
    assert "Traceback" not in err


@pytest.mark.slow
def test_search_ranks_prints_and_goes_on(command, quick, folder):
    arguments = ("search", quick, "--max-phases", "1", "--starts", "1", "--workers", "1", "-o", "sequences")
    ran = command(*arguments)
    assert ran.status == 0, ran.err
    assert "slip forward all the time" in ran.out
    found = command(*arguments, "--json").json
    assert found["complete"]
    assert found["seconds"] > 0
    first, *others = found["ranked"]
    assert (first["sequence"], first["status"], first["reason"]) == ("stick | stick", "solved", "")
    assert first["verification"]["passed"]
    assert load(folder / first["file"]).cost_of_transport == first["cost_of_transport"]
    assert {other["sequence"] for other in others} == {
        "slip+ | stick",
        "slip+ | slip+",
        "slip- | stick",
        "slip- | slip-",
    }
    assert all(other["status"] != "solved" and other["reason"] for other in others)
    assert command(*arguments, "--set", "intervals=12").status == 2


@pytest.mark.slow
def test_compare_labels_its_figure_by_contact_sequences_and_the_names_of_the_files(
    command, slip_file, folder, monkeypatch, sticking
):
    from gaitopt.plot import comparison_figure

    labels, draw = [], comparison_figure.plot_comparison

    def record(comparison, style):
        labels.append(list(comparison.gaits))
        return draw(comparison, style=style)

    monkeypatch.setattr(comparison_figure, "plot_comparison", record)
    save(sticking, folder / "stick.h5")
    (folder / "again.h5").write_bytes(slip_file.read_bytes())
    assert command("compare", slip_file, "stick.h5").status == 0
    assert command("compare", slip_file, "again.h5").status == 0
    assert labels == [
        ["slip+ stick | slip+ (compass_slip)", "stick | stick (stick)"],
        ["slip+ stick | slip+ (compass_slip)", "slip+ stick | slip+ (again)"],
    ]


@pytest.mark.slow
def test_compare_sets_gaits_side_by_side(command, slip_file, folder):
    other = folder / "other.h5"
    other.write_bytes(slip_file.read_bytes())
    ran = command("compare", slip_file, other, "-o", "both.pdf")
    assert ran.status == 0, ran.err
    assert "impact loss [J/m]" in ran.out
    assert (folder / "both.pdf").stat().st_size > 1000
    found = command("compare", slip_file, other, "--multipliers", "--width", 3.5, "--font-size", 6, "--json").json
    assert imread(found["figure"]).shape[1] == pytest.approx(3.5 * DOTS_PER_INCH, rel=0.05)
    assert [gait["label"] for gait in found["gaits"]] == ["compass_slip", "other"]
    assert found["gaits"][0]["largest_multiplier"] < 1
    assert found["figure"] == "comparison.png"
    assert command("compare", "none.h5").status == 2
    assert f"got {slip_file} twice" in command("compare", slip_file, slip_file).err


@pytest.mark.slow
def test_compare_takes_the_robot_of_a_script(command, write_old_file, folder, root):
    write_old_file(folder / "gait.h5", "mine")
    own = "import dataclasses\nfrom compass_slip import problem as usual\n\n\ndef problem():\n    given = usual()\n"
    (folder / "own.py").write_text(
        f"import sys\nsys.path.insert(0, {str(root / 'problems')!r})\n{own}"
        "    return given.replace(robot=dataclasses.replace(given.robot, name='mine'))\n"
    )
    refused = command("compare", "gait.h5", "--multipliers")
    assert "contains only the name of its robot, 'mine', which is not in the catalogue" in refused.err
    ran = command("compare", "gait.h5", "--multipliers", "--problem", "own.py")
    assert ran.status == 0, ran.err
    assert "largest multiplier" in ran.out


@pytest.mark.slow
def test_pareto_prints_the_front_and_its_knee(command, quick, folder):
    arguments = ("pareto", quick, "--points", "3", "--workers", "1", "-o", "front.nc", "--figure", "front.png")
    ran = command(*arguments)
    assert ran.status == 0, ran.err
    assert "peak torque [N m]" in ran.out
    assert (folder / "front.png").is_file()
    again = command(*arguments, "--json").json
    assert again["complete"]
    assert again["objectives"] == ["cost", "peak_torque"]
    assert all(point["front"] and point["verified"] for point in again["points"])
    assert command("pareto", quick, "--objectives", "cost,spectral_radius").status == 2
    assert command("pareto", quick, "--bounds", "speed=1").status == 2


@pytest.mark.parametrize(("status", "said"), [("pending", "not all sequences computed"), ("infeasible", "no gait")])
def test_a_point_without_a_gait_is_not_reported_as_failed_while_sequences_are_missing(capsys, status, said):
    place, sequences = ("sequence", "friction"), ["stick | stick", "slip+ stick | slip+"]
    table = xr.Dataset(
        {"cost_of_transport": (place, [[0.02, np.nan], [np.nan, np.nan]], {"units": "1"})},
        {"sequence": sequences, "friction": ("friction", [0.1, 0.2], {"units": "1"})},
    )
    table["lowest_sequence"] = ("friction", ["stick | stick", ""])
    table["status"] = (place, [["solved", "infeasible"], ["infeasible", status]])
    study_output._print_lowest(table, ["friction"])
    assert capsys.readouterr().out.rstrip().endswith(said)


@pytest.mark.parametrize(("measured", "header"), [(True, "recovered push"), (False, "infeasible")])
def test_the_cost_of_a_single_sequence_is_printed_once(capsys, measured, header):
    cost = [[0.0171, np.nan]]
    table = xr.Dataset(
        {"cost_of_transport": (("sequence", "friction"), cost, {"units": "1"})},
        {"sequence": ["stick | stick"], "friction": ("friction", [0.1, 0.2], {"units": "1"})},
    )
    if measured:
        table["recovered_push"] = table.cost_of_transport.assign_attrs(units="rad/s")
    table["lowest_sequence"] = ("friction", ["stick | stick", ""])
    table["status"] = (("sequence", "friction"), [["solved", "infeasible"]])
    table["reason"] = (("sequence", "friction"), [["", ""]])
    study_output.print_sweep(table)
    printed = capsys.readouterr().out
    assert (printed.count("cost of transport"), printed.count("infeasible")) == (1, 1)
    assert header in printed


@pytest.mark.slow
def test_a_cluster_finds_the_same_and_knows_the_classes_of_a_script(command, quick, scheduler):
    """The last test of this file: the processes of the cluster, which end with the file, also work while they wait."""
    arguments = ("sweep", quick, "--over", "friction=0.14,0.18", "--starts", "1")
    far = command(*arguments, "--scheduler", scheduler, "-o", "far.nc")
    assert far.status == 0, far.err
    assert command(*arguments, "--workers", "1", "-o", "near.nc").status == 0
    cluster, process = load_sweep("far.nc"), load_sweep("near.nc")
    assert cluster.identical(process)
    for name, values in process.data_vars.items():
        assert values.dtype == object or cluster[name].values.tobytes() == values.values.tobytes()
    both = command(*arguments, "--scheduler", scheduler, "--workers", "1", "-o", "f.nc")
    assert both.status == 2
    assert "--workers and --scheduler exclude each other" in both.err
