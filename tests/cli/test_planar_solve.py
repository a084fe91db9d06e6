"""``gaitopt solve``, ``show`` and ``verify`` for robots with several contacts."""

import json
import shutil
from pathlib import Path

import pytest

from gaitopt.cli.app import main
from gaitopt.ocp.multicontact import planar_solver

MONOPOD = str(Path(__file__).parents[2] / "problems" / "monopod.py")
QUICK = ["--set", "stance_intervals=6", "--set", "flight_intervals=16", "--set", "clearance=0.02"]


def run(capsys, *words):
    with pytest.raises(SystemExit) as end:
        main([*words])
    return end.value.code, capsys.readouterr()


@pytest.fixture(scope="module")
def hop(tmp_path_factory):
    """Return the file of a hop that the command line solved."""
    path = tmp_path_factory.mktemp("hop") / "hop.h5"
    with pytest.raises(SystemExit) as end:
        main(["solve", MONOPOD, *QUICK, "-o", str(path), "--quiet"])
    assert end.value.code == 0
    return path


def test_the_summary_has_forces_and_impulses_by_contact(capsys, hop):
    status, printed = run(capsys, "show", str(hop), "--json")
    data = json.loads(printed.out)
    assert status == 0
    assert (data["status"], data["file"]) == ("solved", str(hop))
    assert data["verification"]["passed"]
    assert data["phases"][0]["modes"]["foot"] == "stick"
    assert data["phases"][0]["largest_normal_force"]["foot"] > 300
    assert data["impact"]["outcome"]["foot"] == "stick"
    assert data["impact"]["impulse"]["foot"][1] > 1
    assert data["problem"]["events"] == ["foot opens", "foot closes"]


def test_the_file_states_its_script_and_parameters(capsys, hop):
    script = json.loads(run(capsys, "show", str(hop), "--json")[1].out)["problem"]["script"]
    assert script["file"] == "monopod.py"
    assert script["set"] == ["stance_intervals", "flight_intervals", "clearance"]
    assert script["parameters"]["clearance"] == 0.02


def test_the_table_of_a_file_is_that_of_the_solution(capsys, hop):
    status, printed = run(capsys, "show", str(hop))
    assert status == 0
    for part in (
        "foot stick > flight |",
        "hop_effort",
        "foot closes at 0.4 s; impulse foot (",
        "passed: contact sequence",
    ):
        assert part in " ".join(printed.out.split())


def test_a_file_is_verified_without_its_script(capsys, hop, tmp_path, monkeypatch):
    shutil.copy(hop, tmp_path / "alone.h5")
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, "verify", "alone.h5", "--json")
    data = json.loads(printed.out)
    assert (status, data["verification"]["passed"]) == (0, True)
    assert data["verification"]["state_error"] < 1e-6


def test_a_file_is_verified_with_the_robot_of_its_script(capsys, hop):
    assert run(capsys, "verify", str(hop), "--problem", MONOPOD, "--json")[0] == 0


@pytest.mark.parametrize("other", ["compass_slip.py", "compass_double_support.py"])
def test_a_script_with_another_robot_is_refused(capsys, hop, other):
    status, printed = run(capsys, "verify", str(hop), "--problem", str(Path(MONOPOD).with_name(other)))
    assert status == 2
    assert "is not the robot 'monopod' of the gait. It differs in: coordinates and actuators" in printed.err


def test_the_file_has_the_name_of_the_script_by_default(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, "solve", MONOPOD, *QUICK)
    assert status == 0
    assert "foot stick > flight |" in printed.out
    assert [path.name for path in tmp_path.iterdir()] == ["monopod.h5"]


def test_a_gait_is_exported_as_a_controller(capsys, hop, tmp_path):
    path = tmp_path / "controller.py"
    assert run(capsys, "export", str(hop), "-o", str(path), "--law", "joint_pd")[0] in (0, None)
    text = path.read_text(encoding="utf-8")
    assert "class Controller" in text
    assert "robot monopod, law joint_pd" in text


@pytest.mark.slow
def test_gaits_are_compared(capsys, hop, tmp_path):
    figure = tmp_path / "hops.png"
    other = tmp_path / "other.h5"
    shutil.copy(hop, other)
    status, printed = run(capsys, "compare", str(hop), str(other), "--multipliers", "-o", str(figure), "--json")
    assert status in (0, None)
    first, second = json.loads(printed.out)["gaits"]
    assert figure.exists()
    assert first | {"label": second["label"]} == second
    assert first["sequence"] == "foot stick > flight |"
    assert first["largest_multiplier"] > 0
    status, printed = run(capsys, "compare", str(hop), str(other), "-o", str(figure))
    assert status in (0, None)
    assert "peak leg force [N]" in printed.out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["-o", "hop.txt"], "'.txt' is not that of a known format. Use .h5"),
        (["-o", "missing/hop.h5"], "missing"),
        (["--set", "sequence=foot stick > flight"], "must end with an event"),
        (["--set", "friction=0"], "finite friction coefficient greater than 0"),
    ],
)
def test_invalid_input_is_refused_in_a_sentence(capsys, words, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, "solve", MONOPOD, *words)
    assert status == 2
    assert sentence in " ".join(printed.err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [("stability",), ("simulate",), ("push", "--law", "lqr")])
def test_an_interrupt_of_the_solve_of_another_command_ends_it_with_130(command, monkeypatch, words):
    solve_uninterrupted = planar_solver.solve_planar

    def stop(iteration):
        raise KeyboardInterrupt

    monkeypatch.setattr(planar_solver, "solve_planar", lambda problem: solve_uninterrupted(problem, observer=stop))
    result = command(words[0], MONOPOD, *words[1:])
    assert result.status == 130
    assert result.err.splitlines()[-1] == "Interrupted; no result was written."
