"""gaitopt export."""

import json

import pytest


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
