"""Gaits of several steps on the command line: solved from a script, shown, verified, drawn and animated."""

import pytest

from gaitopt.ocp import load_steps
from gaitopt.report import show_in_notebook
from gaitopt.study import load_result

SCRIPT = """
from gaitopt import Collocation, GaitProblem, Limits, compass_biped
from gaitopt.ocp import MultiStepProblem


def problem(longer=0.47):
    step = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
        limits=Limits(torque=10), objective="torque_squared", transcription=Collocation(intervals=12),
    )
    return MultiStepProblem(steps=(step, step.replace(step_length=longer)), name="period two")
"""


@pytest.mark.slow
def test_a_gait_of_two_steps_is_solved_shown_verified_and_drawn(command, script, folder):
    run = command("solve", script(SCRIPT), "-o", "two.h5", "--json")
    assert run.status == 0, run.err
    assert run.json["verification"]["passed"]
    assert [step["step_length"] for step in run.json["steps"]] == pytest.approx([0.45, 0.47])
    assert load_steps(folder / "two.h5").problem.name == "period two"
    shown = command("show", "two.h5").out
    assert "stick | stick" in shown
    assert "torque squared:" in shown
    assert "objective" not in shown
    assert command("verify", "two.h5", "--json").json["verification"]["passed"]
    assert load_steps(folder / "two.h5").verification.passed
    assert command("verify", "two.h5", "-o", "again.h5", "--json").json["file"] == "again.h5"
    assert load_steps(folder / "again.h5").verification == load_steps(folder / "two.h5").verification
    assert "replay: passed" in command("show", "again.h5").out
    for name, picture in (("plot", "two.png"), ("animate", "two.gif"), ("report", "two.html")):
        assert command(name, "two.h5", "-o", picture).status == 0
        assert (folder / picture).stat().st_size > 0
    assert command("report", "two.h5", "--json").json["gait_verified"] == {"two": True}
    page = (folder / "two.html").read_text(encoding="utf-8")
    assert page.count("<tr>") >= 7
    assert "Force ratio and friction cone" in page
    assert page.count(">torque squared<") == 2
    assert "slope [deg]" in page
    card = show_in_notebook(load_result(folder / "two.h5"))
    assert "stick | stick" in card
    assert "<svg" in card


def test_a_problem_of_several_steps_is_shown_as_mathematics(command, script):
    shown = command("show", script(SCRIPT)).out
    assert shown.startswith("Gait of 2 steps of compass_biped\n  minimise    J1 + J2\n")
    assert "stick | stick, otherwise as step 1 with\n  J2 " in shown
    assert shown.count("  parameters  ") == 1
    assert "step 1 follows the last step" in shown
    facts = command("show", "own.py", "--json").json
    assert [step["step_length"] for step in facts["steps"]] == [0.45, 0.47]
    equal = command("show", "own.py", "--set", "longer=0.45").out
    assert "  step 2      stick | stick, as step 1\n" in equal


def test_options_for_single_steps_are_refused(command, script):
    run = command("solve", script(SCRIPT), "--guess", "walk.csv")
    assert run.status == 2
    assert "--guess is not accepted" in run.err


def test_an_interrupted_solve_has_its_exit_status(command, script, monkeypatch):
    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.cli.multistep_output._describe_iteration", stop)
    assert command("solve", script(SCRIPT), "-o", "two.h5").status == 130


@pytest.mark.slow
def test_the_script_of_the_rough_floor_is_solved_and_drawn(command, folder, root):
    run = command("solve", root / "problems" / "studies" / "compass_rough_floor.py", "-o", "rough.h5", "--json")
    assert run.status == 0, run.err
    assert run.json["verification"]["passed"]
    steps = run.json["steps"]
    assert [step["friction"] for step in steps] == [0.5, 0.5, 0.05, 0.5, 0.5]
    rises = [step["rise"] for step in steps]
    assert rises[:3] == pytest.approx([0, 0.01, 0], abs=1e-9)
    assert sum(rises) == pytest.approx(0.01 - 0.02, abs=1e-9)
    assert load_steps(folder / "rough.h5").motion.jumps[-1].q_next[1] == pytest.approx(0.01 - 0.02, abs=1e-6)
    assert command("verify", "rough.h5", "--json").json["verification"]["passed"]
    assert command("plot", "rough.h5", "-o", "rough.png").status == 0
