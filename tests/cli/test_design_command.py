"""gaitopt design: families, single problems with free parameters, and robust gaits."""

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from gaitopt import load, solve
from gaitopt.cli.design_command import _describe_objective
from gaitopt.design.scenario_test import ScenarioTest, Walk
from gaitopt.design.scenarios import Scenario

SCRIPT = """
from gaitopt import Collocation, Family, GaitProblem, Limits, compass_biped


def problem(speeds=(0.6, 0.65), torque=6.0, family=True, free=(1.0, 3.0)):
    base = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=speeds[0], step_length=0.45,
        limits=Limits(torque=torque), objective="torque_squared", transcription=Collocation(intervals=20),
        free={"hip_mass": free} if free else {},
    )
    return Family([base.replace(speed=speed) for speed in speeds]) if family else base
"""


def test_another_command_on_a_family_names_the_command_for_families(command, script):
    run = command("solve", script(SCRIPT, "family.py"))
    assert run.status == 2
    assert "has a family of gaits; use 'gaitopt design " in run.err


def test_a_family_is_solved_replayed_and_saved(command, script, folder):
    run = command("design", script(SCRIPT), "--json")
    assert run.status == 0, run.err
    assert run.json["status"] == "solved"
    assert 1.0 < run.json["design"]["hip_mass"] < 3.0
    assert [gait["speed"] for gait in run.json["gaits"]] == pytest.approx([0.6, 0.65])
    for file in run.json["files"]:
        gait = load(folder / file)
        assert gait.verification.passed
        assert gait.motion.parameters["hip_mass"] == pytest.approx(run.json["design"]["hip_mass"])


@pytest.mark.parametrize(
    ("weights", "worst_case", "text"),
    [
        ((0.5, 0.5), True, "torque squared: 4, the largest of the gaits (gait 2)"),
        ((0.75, 0.25), True, "torque squared: 2.25, the largest weighted one (gait 1, weight 0.75)"),
        ((0.5, 0.5), False, "torque squared: 3.5, the mean of the gaits"),
        ((0.75, 0.25), False, "torque squared: 3.25, the weighted mean of the gaits"),
    ],
)
def test_the_objective_of_a_family_is_stated_with_its_kind(weights, worst_case, text):
    shares = [weight * cost for weight, cost in zip(weights, (3.0, 4.0), strict=True)]
    objective = max(shares) if worst_case else sum(shares)
    gait = SimpleNamespace(problem={"objective": "torque_squared"})
    result = SimpleNamespace(gaits=(gait, gait), weights=weights, costs=(3.0, 4.0), objective=objective)
    assert _describe_objective(result, worst_case) == text


def test_a_single_problem_is_a_family_of_one(command, script, folder):
    run = command("design", script(SCRIPT), "--set", "family=False", "-o", "here")
    assert run.status == 0, run.err
    assert "design: hip_mass " in run.out
    assert "passed" in run.out
    assert 1.0 < load(folder / "here" / "own_1.h5").design["hip_mass"] < 3.0


PLANAR = """
from gaitopt import Collocation
from gaitopt.model import compass_with_two_feet
from gaitopt.ocp import PlanarLimits, PlanarProblem


def problem(free=(1.0, 3.0)):
    return PlanarProblem(
        robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
        objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
        transcription=Collocation(intervals=10), free={"hip_mass": free} if free else {},
    )
"""


def test_a_robot_with_several_contacts_is_designed_as_well(command, script, folder):
    run = command("design", script(PLANAR), "-o", "here")
    assert run.status == 0, run.err
    assert "design: hip_mass 2.4" in run.out
    gait = load(folder / "here" / "own_1.h5")
    assert 2.4 < gait.design["hip_mass"] < 2.5
    assert gait.verification.passed
    refused = command("design", script(PLANAR), "--set", "free=None")
    assert refused.status == 2
    assert "it returned a PlanarProblem without free parameters" in refused.err


def test_an_interrupted_solve_ends_with_status_130(command, script, folder, monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.ocp.solver.solve", lambda problem, **_: solve(problem, observer=interrupt))
    run = command("design", script(PLANAR), "--json")
    assert (run.status, run.json["status"], run.json["files"]) == (130, "interrupted", [])


@pytest.mark.slow
def test_a_family_that_is_not_solved_writes_nothing(command, script, folder):
    run = command("design", script(SCRIPT), "--set", "torque=0.1")
    assert run.status == 1
    assert "nothing was written. To repeat the design: gaitopt design " in run.out
    assert run.out.endswith("own.py --set torque=0.1\n")
    assert not (folder / "own").exists()
    assert "earlier design" not in run.out
    (folder / "own").mkdir()
    for number in (1, 2):
        (folder / "own" / f"own_{number}.h5").write_text("from an earlier design")
    again = command("design", script(SCRIPT), "--set", "torque=0.1")
    assert again.status == 1
    assert f"{Path('own', 'own_1.h5')}, {Path('own', 'own_2.h5')} are unchanged; they are from an earlier" in again.out


@pytest.mark.parametrize("setting", ["free=None", "speeds=(0.6,)"])
def test_a_problem_without_free_parameters_is_refused(command, script, setting):
    run = command("design", script(SCRIPT), "--set", setting, "--set", f"family={setting != 'free=None'}")
    assert run.status == 2
    assert "free" in run.err or "at least two problems" in run.err


ROBUST = """
from gaitopt import Collocation, GainSearchOptions, GaitProblem, Limits, Scenarios, compass_biped, joint_pd
from gaitopt.design import RobustProblem


def governor(robot, motion, torque_limit):
    law = joint_pd(robot, motion, torque_limit=torque_limit)
    return law.with_gains({"hip_stiffness": 20.0, "ankle_stiffness": 20.0, "hip_damping": 4.0, "ankle_damping": 4.0})


def problem(law="feedforward", friction=0.19):
    gait = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=friction, speed=0.6, step_length=0.45,
        limits=Limits(torque=6), objective="torque_squared", transcription=Collocation(intervals=20),
    )
    scenarios = Scenarios(ranges={"friction": (0.18, 0.2)}, values=2, steps=3, tolerance=1e-2)
    return RobustProblem(gait, scenarios, law=law, search=GainSearchOptions(samples=0, starts=1, evaluations=2))
"""


def test_a_robust_gait_is_planned_tested_and_saved(command, script, folder):
    (folder / "here").mkdir()
    (folder / "here" / "own_failed.h5").write_text("from an earlier design")
    run = command("design", script(ROBUST), "--count", "3", "-o", "here")
    assert run.status == 0, run.err
    assert run.out.endswith(f"{Path('here', 'own_failed.h5')} is unchanged; it is from an earlier design.\n")
    assert run.out.startswith("robust: 2 of 2 candidate scenarios survived under feedforward, additional cost +")
    assert "; 3 of 3 unseen scenarios survived\n" in run.out
    assert "gait in unseen scenarios: maintained at 3 of 3 friction coefficients" in run.out
    assert load(folder / "here" / "own.h5").verification.passed
    assert not (folder / "here" / "own_law.json").exists()
    shown = " ".join(command("show", folder / "here" / "own.h5").out.split())
    assert "script own.py, SHA-256 " in shown
    assert "scenarios friction 0.18 to 0.2; 3 steps, tolerance 0.01" in shown
    reached = "2 of 2 candidate scenarios survived under feedforward, 3 of 3 unseen ones"
    assert f"robustness robust: {reached}, additional cost +" in shown


@pytest.mark.parametrize("option", ["", "--json", "--quiet"])
def test_a_plan_that_fails_in_unseen_scenarios_is_not_called_robust(command, script, folder, monkeypatch, option):
    """It survives its candidate scenarios; the failed check of the unseen ones is the exit status."""
    worst = Walk(Scenario({"friction": 0.185}), 2, math.inf, "The walker fell.")

    def check(*arguments, count, **options):
        return ScenarioTest(count, count - 1, 0, 0, (worst,), ("friction",))

    monkeypatch.setattr("gaitopt.design.scenario_test.check_scenarios", check)
    run = command("design", script(ROBUST), "--count", "7", "-o", "here", *filter(None, [option]))
    assert run.status == 1
    headline = "not fully robust: 2 of 2 candidate scenarios survived under feedforward, additional cost +"
    ending = "; only 6 of 7 unseen scenarios survived"
    advice = "Worst unseen scenario: friction 0.185: ended after 2 steps: The walker fell. Plan for "
    advice += "narrower ranges or more candidate "
    if option == "--json":
        facts = run.json
        assert (facts["robust"], facts["robust_unseen"]) == (True, False)
        assert facts["message"].startswith(headline)
        assert facts["advice"].startswith(advice)
    else:
        text = run.err if option else run.out
        assert text.startswith(headline)
        assert ending in text
        if not option:
            remark = "not fully robust: only 6 of 7 unseen scenarios survived"
            assert run.out.rstrip().endswith(f"wrote {Path('here', 'own.h5')} ({remark})")
            assert (
                f"{advice}scenarios, with more than 2 values of each range (values=, pushes= of Scenarios)" in run.out
            )
    assert (folder / "here" / "own.h5").exists()
    shown = " ".join(command("show", folder / "here" / "own.h5").out.split())
    assert "not fully robust: 2 of 2 candidate scenarios survived under feedforward, 6 of 7 unseen ones" in shown


@pytest.mark.slow
def test_a_plan_that_is_not_robust_is_saved_as_failed_with_its_worst_scenario(command, script, folder):
    text = ROBUST.replace('"stick | stick", friction=friction', '"slip+ stick | slip+", friction=friction')
    text = text.replace('"friction": (0.18, 0.2)', '"friction": (0.139, 0.141)').replace(
        "tolerance=1e-2", "tolerance=1e-9"
    )
    text = text.replace("speed=0.6, step_length=0.45", "speed=0.633, step_length=0.4713")
    run = command(
        "design", script(text), "--set", "friction=0.14", "--set", "law=joint_pd", "--count", "1", "-o", "here"
    )
    assert run.status == 1, run.err
    printed = " ".join(run.out.split())
    assert "the plan is not robust; its gait and gains were written for inspection" in printed
    assert "The periodic motion of a slipping gait depends on friction" in printed
    assert "state a larger tolerance=" in printed
    assert not (folder / "here" / "own.h5").exists()
    assert (folder / "here" / "own_failed_law.json").exists()
    shown = " ".join(command("show", folder / "here" / "own_failed.h5").out.split())
    assert "worst scenario friction 0.1" in shown


def test_the_law_of_a_robust_gait_may_be_a_function_of_a_script_and_its_gains_are_a_law(command, script, folder):
    path = script(ROBUST)
    run = command("design", path, "--law", f"{path}:governor", "--count", "2", "--json")
    assert run.status == 0, run.err
    assert run.json["robust"]
    assert run.json["robust_unseen"]
    assert run.json["unseen"]["plan"] == {"scenarios": 2, "survived": 2, "pushed": 0, "recovered": 0}
    gait, gains = run.json["files"]
    shown = " ".join(command("show", folder / gains).out.split())
    assert "verified not by random pushes; gaitopt push determines those after which the gait is reached" in shown
    again = command("stability", folder / gait, "--law", folder / gains, "--json")
    assert again.status == 0, again.err
    assert again.json["gaits"][0]["radius"] < 1


def test_a_robust_problem_without_a_gait_ends_with_status_1_and_its_conflicts(command, script, folder):
    text = ROBUST.replace('"friction": (0.18, 0.2)', '"friction": (0.02, 0.2)')
    (folder / "own").mkdir()
    (folder / "own" / "own.h5").write_text("from an earlier design")
    run = command("design", script(text).name, "--set", "friction=0.02")
    assert run.status == 1
    assert "No gait was found at friction 0.02" in run.err
    assert "Conflicts: " in run.err
    assert "friction is 0.02: " in run.err
    assert f"{Path('own', 'own.h5')} is unchanged; it is from an earlier design." in run.err
    assert (
        f"{Path('own', 'own_failed.h5')} contains this problem without the scenarios, for 'gaitopt solve'." in run.err
    )
    assert run.err.endswith(" To repeat the design: gaitopt design own.py --set friction=0.02\n")
    assert "near the initial guesses" not in run.err  # the conflicts state more
    assert {path.name for path in (folder / "own").iterdir()} == {"own.h5", "own_failed.h5"}
    again = command("solve", folder / "own" / "own_failed.h5", "--json")
    assert (again.status, again.json["status"]) == (1, "infeasible")
    assert again.json["conflicts"]


def test_a_nominal_friction_outside_its_range_is_refused(command, script):
    run = command("design", script(ROBUST), "--set", "friction=0.25")
    assert run.status == 2
    text = " ".join(run.err.split())
    assert "the range of friction must contain the nominal value of the problem, 0.25, got (0.18, 0.2)" in text


def test_other_problems_have_no_law_and_robust_ones_are_not_solved_alone(command, script):
    run = command("design", script(SCRIPT), "--law", "feedforward")
    assert run.status == 2
    assert "--law is accepted for a RobustProblem only" in run.err
    run = command("solve", script(ROBUST))
    assert run.status == 2
    assert "gaitopt design" in run.err


@pytest.mark.parametrize("verb", ["plot", "animate", "verify", "tune", "push"])
def test_commands_on_results_name_the_command_that_solves_a_robust_problem(command, root, verb):
    script = root / "problems/compass_robust.py"
    run = command(verb, script)
    assert run.status == 2
    assert "is a script with a robust problem, not a" in run.err
    assert f"run 'gaitopt design {script}' first" in run.err
    assert "gaitopt solve" not in run.err
