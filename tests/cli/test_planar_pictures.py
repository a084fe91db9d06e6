"""Pictures, reports, tables and simulations of robots with several contacts on the command line."""

import csv
import json
from pathlib import Path

import pytest

from gaitopt import save
from gaitopt.cli.app import main

PROBLEMS = Path(__file__).parents[2] / "problems"
KNEED = str(PROBLEMS / "kneed_walker.py")


@pytest.fixture(scope="module")
def hop(hop_gait, tmp_path_factory):
    return str(save(hop_gait, tmp_path_factory.mktemp("hop") / "hop.h5"))


def run(capsys, *words):
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return end.value.code, capsys.readouterr()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "name", "options"),
    [
        ("plot", "hop.png", []),
        ("plot", "hop.pdf", ["--width", "3.5", "--no-title"]),
        ("animate", "hop.gif", ["--steps", "1", "--slow", "0.5"]),
        ("report", "hop.html", []),
        ("export", "hop.csv", []),
        ("export", "hop.json", []),
        ("export", "hop.c", ["--law", "step_lqr"]),
    ],
)
def test_a_saved_gait_is_drawn_reported_and_exported(capsys, hop, tmp_path, command, name, options):
    status, printed = run(capsys, command, hop, "-o", tmp_path / name, *options, "--json")
    assert status in (0, None)
    assert json.loads(printed.out)["file"] == str(tmp_path / name)
    assert (tmp_path / name).stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("plot", "-o", "hop.bmp"), "'.bmp' is not that of a known format"),
        (("animate", "-o", "hop.png"), "'.png' is not that of a known format"),
        (("export", "-o", "hop.xlsx"), "'.xlsx' is not that of a known format"),
        (("export", "-o", "hop.c", "--law", "pid"), "There is no feedback law 'pid' for a robot with several contacts"),
        pytest.param(
            ("export", "-o", "hop.json", "--law", "lqr"),
            "leave out the law, or export a controller",
            marks=pytest.mark.slow,
        ),
        (("compare", "-o", "hop.xlsx"), "'.xlsx' is not that of a known format"),
    ],
)
def test_wrong_arguments_are_refused_in_a_sentence(capsys, hop, words, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, words[0], hop, *words[1:])
    assert status == 2
    assert sentence in " ".join(printed.err.split())
    assert not list(tmp_path.iterdir())


def test_a_walk_is_simulated_and_its_events_are_listed(capsys, tmp_path):
    path = tmp_path / "walk.csv"
    status, printed = run(capsys, "simulate", KNEED, "--steps", "2", "-o", path, "--json")
    data = json.loads(printed.out)
    assert (status, data["stop"], data["steps"], data["file"]) == (0, "steps_done", 2, str(path))
    names = [event["names"][0] for event in data["events"]]
    assert names == ["knee B closes", "foot B closes", "knee A closes", "foot A closes"]
    assert data["events"][0]["time"] == pytest.approx(0.3486120004843, abs=1e-9)  # independent integration
    assert data["events"][1]["impulse"]["foot B"][1] > 0
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert "foot_A_mode" in rows[0]
    touchdown = data["events"][1]["time"]
    assert {row["step"] for row in rows if float(row["time_s"]) < touchdown} == {"0"}
    assert {row["step"] for row in rows if float(row["time_s"]) > touchdown} == {"1"}


def test_a_hop_that_takes_longer_than_the_gait_is_simulated_for_the_requested_steps(capsys):
    """A fast landing leads to higher hops; the duration of three hops of the gait contains only one of them."""
    state = ["--state", "body_rate=-6"]
    status, printed = run(capsys, "simulate", PROBLEMS / "hopper.py", "--steps", "3", *state, "--json")
    data = json.loads(printed.out)
    landings = [event["time"] for event in data["events"] if "sole closes" in event["names"]]
    assert (status, data["stop"], data["steps"], len(data["sequences"]), len(landings)) == (0, "steps_done", 3, 3, 3)


@pytest.mark.parametrize("name", ["walk.png", pytest.param("walk.gif", marks=pytest.mark.slow)])
def test_a_walk_is_drawn(capsys, tmp_path, name):
    status, printed = run(capsys, "simulate", KNEED, "--steps", "1", "-o", tmp_path / name)
    assert status == 0
    assert "knee B closes" in printed.out
    assert f"wrote {tmp_path / name}" in printed.out
    assert (tmp_path / name).stat().st_size > 5000


def test_a_walk_is_not_written_as_a_gait_file(capsys, tmp_path):
    """It would be a table that no command reads as a gait."""
    status, printed = run(capsys, "simulate", KNEED, "--steps", "1", "-o", tmp_path / "walk.h5")
    assert status == 2
    expected = "the suffix '.h5' is not that of a known format. Use .csv (trajectories), .png"
    assert expected in " ".join(printed.err.split())
    assert not list(tmp_path.iterdir())


def test_the_walk_of_one_foot_is_drawn_too(capsys, tmp_path):
    script = PROBLEMS / "compass_passive.py"
    status, _ = run(capsys, "simulate", script, "--steps", "2", "-o", tmp_path / "walk.png", "--quiet")
    assert status == 0
    assert (tmp_path / "walk.png").stat().st_size > 5000


def test_a_changed_state_stands_on_the_foot(capsys):
    status, printed = run(capsys, "simulate", KNEED, "--steps", "1", "--state", "a_rate=-1.12", "--json")
    data = json.loads(printed.out)
    assert status == 0
    assert 0.3 < data["events"][0]["time"] < 0.4
    assert abs(data["energy"]["relative_residual"]) < 1e-9


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--state", "knee=0.1"], "--state: there is no coordinate 'knee'. Known: x, y"),
        (["--state", "a=steep"], "--state must have the form NAME=NUMBER"),
        (["--engine", "heyoca"], "There is no engine 'heyoca'. Did you mean 'heyoka'"),
        (["--steps", "0"], "'--steps'"),
        (["-o", "missing/walk.png"], "missing"),
    ],
)
def test_wrong_options_of_a_simulation_are_refused_in_a_sentence(capsys, words, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, "simulate", KNEED, *words)
    assert status == 2
    assert sentence in " ".join(printed.err.split())


def test_a_simulation_without_a_gait_has_the_status_of_a_failure(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, "simulate", KNEED, "--set", "slope=-3")
    assert status == 1
    assert "No periodic gait was found" in printed.err


@pytest.mark.slow
def test_a_walk_over_steps_and_patches(capsys, tmp_path):
    options = ["--steps", 2, "--rise", "0.6:-0.01", "--patch", "0.2:0.7:0.9"]
    status, printed = run(capsys, "simulate", KNEED, *options, "--json", "-o", tmp_path / "walk.gif")
    plain_status, plain = run(capsys, "simulate", KNEED, "--steps", 2, "--json")
    assert status == plain_status == 0
    landings = [
        next(event["time"] for event in json.loads(text.out)["events"] if "foot B closes" in event["names"])
        for text in (printed, plain)
    ]
    assert landings[1] == pytest.approx(0.5643281659150, abs=1e-9)  # source: tests/stability/test_planar_cycles.py
    assert landings[0] > landings[1] + 0.01
    assert (tmp_path / "walk.gif").stat().st_size > 1000


@pytest.mark.parametrize(
    ("script", "option", "sentence"),
    [
        (KNEED, ("--rise", "0.6"), "--rise must have the form POSITION:HEIGHT, lengths in m, got '0.6'"),
        (KNEED, ("--patch", "1:0:0.1"), "begin before it ends"),
        (str(PROBLEMS / "compass_passive.py"), ("--rise", "0.6:0.1"), "robots with several contacts (assemble_planar)"),
        (str(PROBLEMS / "compass_passive.py"), ("--patch", "0:1:0.1"), "--set friction=VALUE changes it for the whole"),
    ],
)
def test_terrain_options_that_are_refused(capsys, script, option, sentence):
    status, printed = run(capsys, "simulate", script, *option)
    assert status == 2
    assert sentence in " ".join(printed.err.split())
