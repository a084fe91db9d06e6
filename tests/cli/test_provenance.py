"""Files and reports name the objective's parameters and the script with its parameters and digest."""

import hashlib
import json

import pytest

from gaitopt import GaitProblem, PositiveWork, compass_biped, load
from gaitopt.cli.design_command import _add_record
from gaitopt.cli.script import optimal_problem, read_script
from gaitopt.study.storage.study_key import record_script, study_key

SCRIPT = """\
from dataclasses import dataclass

from gaitopt import GaitProblem, Limits, Objective, TorqueSquared, compass_biped


@dataclass(frozen=True)
class Priced(Objective):
    price: float
    weights: tuple = (1.0, 2.0)
    hook: object = print
    base: TorqueSquared = TorqueSquared()
    name = "priced"
    uses_power = False
    per_weight_and_travel = False
    smooth = True

    def integrand(self, point):
        return self.price * (self.weights[0] * point.torque[0] ** 2 + self.weights[1] * point.torque[1] ** 2)


def problem(friction=0.3, price=1.0, hook=len):
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=friction, speed=0.6, step_length=0.45,
        limits=Limits(torque=8), objective=Priced(price),
    )
"""


@pytest.fixture
def solved(script, command, folder):
    path = script(SCRIPT)
    run = command("solve", path, "--set", "price=0.5", "-o", "gait.h5", "--json")
    assert run.status == 0, run.err
    return path, run.json["problem"]


def test_a_file_names_objective_and_script(solved, folder):
    path, problem = solved
    script = {
        "file": "own.py",
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "parameters": {"friction": 0.3, "price": 0.5, "hook": "<built-in function len>"},
        "set": ["price"],
    }
    assert problem["objective_parameters"] == {"price": 0.5, "weights": [1.0, 2.0], "base": {"type": "TorqueSquared"}}
    assert problem["script"] == script
    assert load(folder / "gait.h5").problem["script"] == script


def test_show_and_the_report_name_them(solved, command, folder):
    shown = command("show", "gait.h5").out
    assert f"{load('gait.h5').solver.objective:.6g}" in shown.partition("\n priced ")[2].partition("\n")[0]
    assert "objective priced (price 0.5, weights [1.0, 2.0], base " in shown
    assert f"own.py, SHA-256 {solved[1]['script']['sha256']}" in shown
    assert "price=0.5" in shown
    assert "friction=0.3" in shown
    assert command("report", "gait.h5").status == 0
    page = (folder / "gait.html").read_text()
    resolved = page.partition("Problem, fully resolved")[2]
    assert solved[1]["script"]["sha256"] in resolved
    assert "objective_parameters" in resolved


def test_a_problem_of_python_has_objective_parameters_and_no_script():
    problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", objective=PositiveWork(regeneration=0.5))
    assert problem.describe()["objective_parameters"] == {"regeneration": 0.5}
    assert problem.describe()["script"] is None


def test_studies_of_a_robot_with_several_contacts_state_the_parameters_that_were_set(root):
    script = read_script(root / "problems/monopod.py", ["stiffness=2800"])
    stored = json.loads(record_script(optimal_problem(script))["script"])
    assert (stored["file"], stored["set"], stored["parameters"]["stiffness"]) == ("monopod.py", ["stiffness"], 2800.0)
    designed = _add_record(script(), script.record())
    assert designed.describe()["script"] == stored
    assert study_key(designed) == study_key(script())


def test_another_comment_in_the_script_is_no_other_study(solved, script):
    from gaitopt.cli.script import build_problem

    first = study_key(build_problem(solved[0]))
    assert study_key(build_problem(script(SCRIPT + "# a comment\n"))) == first
    assert study_key(build_problem(solved[0], ["price=2"])) != first
