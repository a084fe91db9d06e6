"""gaitopt export."""

import csv
import json

import pytest

from gaitopt import load_sweep


def test_the_suffix_says_what_is_written(command, slip_file, folder):
    for name in ("walk.csv", "walk.json", "walk.c", "walk.py"):
        run = command("export", slip_file, "-o", name)
        assert run.status == 0
        assert run.out == f"wrote {name}\n"
    assert (folder / "walk.csv").read_text(encoding="utf-8").startswith("step,mode,time_s,")
    assert json.loads((folder / "walk.json").read_text(encoding="utf-8"))["format"] == "gaitopt torques"
    run = command("export", slip_file, "-o", "gains.json", "--law", "pd", "--gain", "hip_stiffness=7", "--quiet")
    assert (run.status, run.out) == (0, "")
    gains = json.loads((folder / "gains.json").read_text(encoding="utf-8"))
    assert gains["gains"]["hip_stiffness"] == 7
    assert set(gains["torque_by_state"]["hip"]["th1"]) == {-7.0}
    assert "walk_control" in (folder / "walk.h").read_text(encoding="utf-8")


def test_a_sweep_is_written_as_a_table_or_a_library(command, folder, root):
    words = ("--set", "objective=torque_squared", "--set", "sequence=stick | stick", "--set", "intervals=8")
    over = ("--over", "friction=0.2,0.25", "--with", "stability", "--starts", "1", "--workers", "1", "-o", "f.nc")
    assert command("sweep", root / "problems/compass_slip.py", *words, *over).status == 0
    assert command("export", "f.nc", "-o", "f.csv").out == "wrote f.csv\n"
    with (folder / "f.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["friction"] for line in lines] == ["0.2", "0.25"]
    table = load_sweep(folder / "f.nc")
    for column, values in {
        "sequence": ["stick | stick"] * 2,
        "lowest_sequence": ["stick | stick"] * 2,
        "achieved_speed_m_per_s": table.achieved_speed.values[0],
        "peak_torque_hip_Nm": table.peak_torque.sel(actuator="hip").values[0],
        "multiplier_real_2": table.multiplier_real.values[0, :, 1],
        "verified": [1, 1],
    }.items():
        assert [line[column] for line in lines] == [str(value) for value in values]
    for name in ("f.mat", "f.json"):
        refused = command("export", "f.nc", "-o", name)
        assert refused.status == 2
        assert "Use .csv (table of the points), .py (gait library)." in " ".join(refused.err.split())
    assert "no contact sequence 'slip'" in command("export", "f.nc", "-o", "f.csv", "--sequence", "slip").err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-o", "walk.mat"), "Use .csv (trajectories), .json (torques and gains), .c (dynamics and controller)"),
        (("-o", "nowhere/walk.csv"), "does not exist"),
        ((), "Missing option"),
    ],
)
def test_mistakes(command, slip_file, arguments, message):
    run = command("export", slip_file, *arguments)
    assert run.status == 2
    assert message in run.err


def test_a_walk_as_a_table(command, root, folder):
    run = command(
        "simulate",
        root / "problems/rimless_wheel.py",
        "--state",
        "theta_rate=2.4",
        "--steps",
        2,
        "-o",
        "walk.csv",
        "--json",
    )
    assert run.status == 0
    assert run.json["file"] == "walk.csv"
    assert len({line[:2] for line in (folder / "walk.csv").read_text(encoding="utf-8").splitlines()[1:]}) == 2
