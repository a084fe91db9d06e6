"""tune, push and stability --law on the command line."""

import dataclasses
import itertools
import json
import os
import re
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import GainSearchOptions, PushTest, assess_stability, compass_biped, load, save, tune_feedback
from gaitopt.cli.app import main
from gaitopt.cli.law_option import _warn_of_another_gait, _warn_of_changed_script, design_for, limit_for
from gaitopt.cli.push_output import print_endurance
from gaitopt.progress import TuningStep, VerificationStep
from gaitopt.stability.recovery import Recovery
from gaitopt.tuning import ControllerFamily, load_tuning, save_tuning
from gaitopt.tuning.controller_family import controller_family_named, law_name
from gaitopt.tuning.gain_search import GainSearch
from gaitopt.tuning.record import Tuning
from gaitopt.tuning.tuning_objective import SpectralRadius

GAIT = "docs/examples/compass_slip.h5"
KEYS = [
    *(
        "law",
        "gains",
        "at_bounds",
        "radius_before",
        "radius_after",
        "multipliers",
        "fixed_point_shift",
        "worse_than_open_loop",
    ),
    *("sequence", "planned_sequence", "verified", "evaluations", "search_interrupted", "seconds", "gait_verified"),
]


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code, capsys.readouterr()


def test_the_help_of_tune_lists_only_laws_with_gains(capsys):
    def law_of(command):
        _, text = run(capsys, command, "--help")
        return text.out.partition("--law")[2].partition("--torque-limit")[0]

    assert "joint_pd" in law_of("tune")
    assert "feedforward" not in law_of("tune")
    assert "feedforward" in law_of("push")


def test_stability_under_a_law(capsys):
    code, text = run(capsys, "stability", GAIT, "--law", "computed-torque", "--gain", "damping=12", "--json")
    assert code == 0
    (gait,) = json.loads(text.out)["gaits"]
    assert gait["stable"]
    assert gait["radius"] < 0.3


def test_the_title_of_stability_names_the_law_and_its_gains(capsys):
    _, text = run(capsys, "stability", GAIT, "--law", "pd", "--gain", "hip_stiffness=30")
    shown = " ".join(text.out.split())
    assert shown.startswith("periodic gaits under joint_pd, ankle_stiffness 24 N m/rad, hip_stiffness 30 N m/rad, ")
    assert "none (the gait slips)" in shown
    _, text = run(capsys, "stability", GAIT)
    assert text.out.startswith("periodic gaits (engine ")


@pytest.mark.slow
def test_tune_prints_what_was_found(capsys):
    arguments = ("tune", GAIT, "--law", "computed-torque", "--torque-limit", "8", "--starts", "2", "--json")
    code, text = run(capsys, *arguments)
    facts = json.loads(text.out)
    assert code == 0
    assert facts["law"] == "computed_torque"
    assert set(facts["gains"]) == {"stiffness", "damping"}
    assert facts["radius_after"] < 0.1 < facts["radius_before"]
    assert len(facts["multipliers"]) == 4
    assert facts["verified"]["returned"] == facts["verified"]["starts"] == 2
    assert facts["verified"]["push_radius"] > 0
    assert list(facts) == KEYS
    numbers = {"starts", "returned", "push_radius", "steps", "tolerance"}
    assert set(facts["verified"]) == numbers | {"failure", "failures", "ends", "interrupted"}
    assert facts["verified"]["steps"] == 30


def test_a_search_begins_with_the_gains_of_a_file(tmp_path):
    gait, robot = load(GAIT), compass_biped()
    family = controller_family_named("joint_pd", robot, gait.motion, torque_limit=8)
    values = {"ankle_stiffness": 1000.0, "hip_stiffness": 20.0, "ankle_damping": 9.0, "hip_damping": 3.0}
    search, test = GainSearchOptions(samples=0, starts=1, evaluations=1), PushTest(starts=1, steps=1)
    tuned = tune_feedback(gait, family, search=search, test=test)
    save_tuning(dataclasses.replace(tuned, gains=values), tmp_path / "gains.json")
    starts = {gain.name: gain.start for gain in design_for(gait, robot, str(tmp_path / "gains.json"), 8, False).gains}
    assert starts == values
    moved, former = family.with_starts(values).gains[0], family.gains[0]
    assert moved.start == 1000.0 > former.upper
    assert moved.start**2 == pytest.approx(moved.lower * moved.upper) if former.logarithmic else moved.upper == 2000.0
    assert moved.lower == former.lower


def test_a_gait_that_cannot_be_held_is_reported(capsys):
    """Nothing walks on level ground without torque."""
    code, text = run(capsys, "tune", GAIT, "--law", "pd", "--torque-limit", "1e-3", "--starts", "1", "--json")
    facts = json.loads(text.out)
    assert code == 1
    assert "not stabilised by joint_pd within its torque limits: no periodic gait was found near the plan" in text.err
    assert list(facts) == KEYS
    assert (facts["radius_after"], facts["multipliers"], facts["fixed_point_shift"]) == ("inf", [], None)
    assert (facts["worse_than_open_loop"], facts["sequence"]) == (True, "")
    assert facts["planned_sequence"] == "slip+ stick | slip+"
    counts = {"starts": 1, "returned": 0, "push_radius": 0.0, "steps": 30, "tolerance": 1e-4}
    assert facts["verified"] == counts | {"failure": "", "failures": {}, "ends": {}, "interrupted": False}


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("planned", ["slip+ stick | slip+", "stick | stick"])
def test_a_larger_radius_and_another_contact_sequence_are_stated(capsys, monkeypatch, slip_gait, factor, planned):
    """The open loop serves as the closed loop, of a radius that is half or twice as large as before."""
    cycle = assess_stability(slip_gait)
    tuned = Tuning(
        law=None,
        family="lqr",
        gains={"torque": 3.0},
        bounds={"torque": (0.0, 3.0)},
        objective="spectral_radius",
        radius_before=cycle.radius * factor,
        radius_after=cycle.radius,
        cycle=cycle,
        fixed_point_shift=0.0,
        verified=Recovery(radius=0.0, starts=1, returned=0, steps=30, tolerance=1e-4),
        trials=(),
        evaluations=1,
        seconds=0.0,
        planned_sequence=planned,
    )
    monkeypatch.setattr("gaitopt.tuning.tune.tune_feedback", lambda *_, **__: tuned)
    text = " ".join(run(capsys, "tune", GAIT)[1].out.split())
    bound = "torque is at its upper bound, 3 N m; wider bounds may improve the law, such as with --bound torque=0:6"
    assert bound in text
    facts = json.loads(run(capsys, "tune", GAIT, "--json")[1].out)
    assert facts["at_bounds"] == {"torque": "upper"}
    assert facts["worse_than_open_loop"] == ("larger than in open loop" in text) == (factor < 1)
    assert (facts["sequence"], facts["planned_sequence"]) == ("slip+ stick | slip+", planned)
    changed = f"contact sequence slip+ stick | slip+ under the law, {planned} in the gait"
    assert (changed in text) == (planned == "stick | stick")


def test_the_number_of_evaluations_reaches_the_stated_limit_and_does_not_exceed_it(slip_gait, monkeypatch):
    """1 of the start, 4 random ones and 2 x 30 of the searches, which do not converge."""
    values, steps = itertools.count(), []
    monkeypatch.setattr("gaitopt.tuning.gain_search.GainSearch._value", lambda *_: float(next(values)))
    family = design_for(slip_gait, slip_gait.robot, "computed-torque", 8.0, False)
    options = GainSearchOptions(samples=4, evaluations=30, tolerance=1e-9)
    search = GainSearch(slip_gait, slip_gait.robot, family, SpectralRadius(), (), None, steps.append)
    search.search(options)
    assert [step.number for step in steps] == list(range(1, 66))
    assert {step.limit for step in steps} == {65}


SHORT = ("tune", GAIT, "--law", "computed-torque", "--torque-limit", "8", "--samples", "0", "--evaluations", "3")


@pytest.mark.parametrize(
    ("walk", "text"),
    [
        (1, "no: the verification was interrupted before all starts of a ball were tested"),
        (5, "return to the gait (within 0.0001) in at most 30 steps"),
    ],
)
def test_gains_are_kept_if_their_verification_is_interrupted(capsys, tmp_path, monkeypatch, walk, text):
    """The largest ball of which all starts were tested is reported: two starts each, interrupted in the third ball."""
    seen = []

    def interrupt(step):
        seen.append(step)
        if sum(isinstance(each, VerificationStep) for each in seen) == walk:
            signal.raise_signal(signal.SIGINT)
        return ""

    monkeypatch.setattr("gaitopt.cli.feedback._progress", interrupt)
    gains = tmp_path / "gains.json"
    code, printed = run(capsys, *SHORT, "--starts", "2", "-o", str(gains))
    assert code == 130
    assert text in " ".join(printed.out.split())
    assert re.search(r"gains +stiffness [0-9.e+]+ 1/s\^2, damping [0-9.e+]+ 1/s\n", re.sub(" *\n", "\n", printed.out))
    assert "Interrupted; the gains are not completely verified." in printed.err
    assert "nothing was written" not in printed.err
    facts = json.loads(gains.read_text(encoding="utf-8"))
    assert set(facts["gains"]) == {"stiffness", "damping"}
    assert facts["verified"]["interrupted"]
    assert (facts["verified"]["returned"] > 0) == (walk > 1)
    assert {step.limit for step in seen if isinstance(step, TuningStep)} == {4}  # the start and 3 evaluations
    assert sum(isinstance(step, VerificationStep) for step in seen) == walk


@pytest.mark.parametrize("evaluation", [1, 3])
def test_the_best_gains_are_kept_if_their_search_is_interrupted(capsys, tmp_path, monkeypatch, evaluation):
    """The search ends after the evaluation in which Ctrl-C was pressed, and nothing is verified."""
    seen = []

    def interrupt(step):
        seen.append(step)
        if len(seen) == evaluation:
            signal.raise_signal(signal.SIGINT)
        return ""

    monkeypatch.setattr("gaitopt.cli.feedback._progress", interrupt)
    gains = tmp_path / "gains.json"
    code, printed = run(capsys, *SHORT, "--starts", "2", "-o", str(gains))
    facts = json.loads(gains.read_text(encoding="utf-8"))
    assert code == 130
    assert [type(step) for step in seen] == [TuningStep] * evaluation
    best = min(facts["trials"], key=lambda trial: trial["objective"])
    assert len(facts["trials"]) == evaluation
    assert facts["gains"] == best["gains"]
    assert facts["radius_after"] == pytest.approx(best["objective"], abs=1e-5)
    assert (facts["search_interrupted"], facts["verified"]["returned"]) == (True, 0)
    number = {1: "one evaluation", 3: "3 evaluations"}[evaluation]
    assert f"Interrupted; the gains are the best after {number} and are not verified." in printed.err
    assert "verified no: the search was interrupted" in " ".join(printed.out.split())


@pytest.mark.parametrize("advice", [None, "The heyoka engine simulates walks faster."])
def test_a_faster_engine_is_recommended_before_a_search(capsys, monkeypatch, advice):
    def end(*_, **__):
        raise gaitopt.InputError("the search begins")

    monkeypatch.setattr("gaitopt.simulation.engine_choice.faster_walks", lambda engine: advice)
    monkeypatch.setattr("gaitopt.tuning.tune.tune_feedback", end)
    _, text = run(capsys, *SHORT)
    assert ("heyoka" in text.err) == (advice is not None)


def test_feedback_may_use_more_than_the_plan_of_each_actuator(capsys, tmp_path):
    """A weak ankle does not limit the hip, whose plan must not be cut off."""
    limits = {"ankle": 0.5, "hip": 6.0}
    gait = load(GAIT)
    file = save(dataclasses.replace(gait, problem={**gait.problem, "torque_limit": limits}), tmp_path / "gait.h5")
    assert limit_for(load(file), None) == {"ankle": pytest.approx(0.6), "hip": pytest.approx(7.2)}
    assert limit_for(gait, 3.0) == 3.0
    idle = dataclasses.replace(gait, problem={**gait.problem, "torque_limit": {"ankle": 0.0, "hip": 6.0}})
    save(idle, file)
    code, text = run(capsys, "stability", str(file), "--law", "lqr")
    assert code == 2
    assert "planned without torque at the ankle; set the torque limit of feedback with --torque-limit" in " ".join(
        text.err.split()
    )


@pytest.mark.parametrize(
    ("law", "gain", "message"),
    [
        ("lqr", "torque=nan", "Weights.torque must be a finite number [N m], got nan"),
        ("step-to-step", "rate=0", "Weights.rate must be greater than 0 [rad/s], got 0"),
        ("pd", "hip_stiffness=inf", "hip_stiffness must be a finite number, got inf"),
    ],
)
def test_gains_that_cannot_be(capsys, law, gain, message):
    code, text = run(capsys, "stability", GAIT, "--law", law, "--gain", gain)
    assert code == 2
    assert message in " ".join(text.err.split())


@pytest.mark.parametrize("limit", ["1e6", "1e300"])
def test_torques_so_cheap_that_no_gains_are_found_end_in_a_sentence_or_a_law(capsys, limit):
    code, text = run(capsys, "stability", GAIT, "--law", "lqr", "--torque-limit", limit)
    assert code == (2 if limit == "1e6" else 0), text
    assert ("No linear-quadratic feedback stabilises this gait" in text.err) == (code == 2)


@pytest.mark.parametrize(
    ("function", "spellings"),
    [
        ("joint_pd", ["pd", "joint-pd", "joint pd"]),
        ("computed_torque", ["computed-torque", "computed torque"]),
        ("lqr", []),
        ("step_lqr", ["step-to-step", "step_to_step", "step-lqr"]),
    ],
)
def test_laws_have_the_names_of_their_functions_and_older_spellings_are_accepted(function, spellings):
    assert callable(getattr(gaitopt, function))
    for spelling in (function, *spellings):
        design = design_for(load(GAIT), compass_biped(), spelling, 8.0, stance_angle=False)
        assert design.name == law_name(spelling) == function
    assert design.law({gain.name: gain.start for gain in design.gains}).name == function


def test_a_law_by_the_stance_angle(capsys):
    code, text = run(capsys, "stability", GAIT, "--stance-angle", "--json")
    assert code == 0
    (gait,) = json.loads(text.out)["gaits"]
    assert gait["stable"]
    assert 0.3 < gait["radius"] < 0.95


@pytest.mark.slow
def test_push_prints_a_table(capsys):
    kinds = [word for kind in ("friction patch", "sensor delay", "recovery") for word in ("--kind", kind)]
    quick = ("--steps", "6", "--starts", "1", "--workers", "1")
    code, text = run(capsys, "push", GAIT, "--law", "computed-torque", *quick, *kinds)
    assert code == 0
    assert "friction patch" in text.out
    assert "not survived" in text.out
    assert "sensor delay" in text.out
    assert (
        "computed_torque: 1 of 1 walks return after pushes up to 0.1 rad/s; steps until the return: median" in text.out
    )
    assert "open loop: 1 of 1 walks return" in text.out


@pytest.mark.slow
def test_push_in_open_loop_states_that_no_sensor_is_read(capsys):
    code, text = run(capsys, "push", GAIT, "--law", "feedforward", "--steps", "6", "--starts", "1", "--workers", "1")
    assert code == 0
    assert "No sensor delay: the law does not read the state." in " ".join(text.out.split())
    assert "torque noise" in text.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("tune", GAIT, "--law", "pid"), "no feedback law 'pid'"),
        (("tune", GAIT, "--torque-limit", "-1"), "--torque-limit must be positive"),
        (("stability", GAIT, "--law", "pd", "--gain", "knee=1"), "no gain 'knee'"),
        (("stability", GAIT, "--gain", "knee=1"), "have no gains"),
        (("push", GAIT, "--torque-limit", "3"), "have no limit to set; name a feedback law with --law"),
        (("simulate", GAIT, "--torque-limit", "3"), "have no limit to set; name a feedback law with --law"),
        (("push", GAIT, "--gain", "a=b", "--law", "pd"), "--gain must have the form NAME=NUMBER"),
        (("stability", "problems/compass_passive.py", "--law", "pd"), "--law is accepted for a saved gait only"),
    ],
)
def test_mistakes_are_explained(capsys, arguments, message):
    code, text = run(capsys, *arguments)
    assert code == 2
    assert message in text.err.replace("\n", " ")


SCRIPT = """
import casadi as ca
import numpy as np

from gaitopt import Law, feedforward
from gaitopt.control import control_function, law_inputs


def hip_spring(robot, motion, torque_limit):
    base = feedforward(robot, motion)
    rows = base.table.shape[0]
    inputs = law_inputs(robot, data=rows + 2)
    data = inputs.data
    torque = base.control(*inputs._replace(data=data[:rows]))[0]
    feedback = -data[rows] * (inputs.q[3] - 0.1) - data[rows + 1] * inputs.v[2]
    table = np.vstack([base.table, np.full((1, base.breakpoints.size), 0.2), np.full((1, base.breakpoints.size), 0.1)])
    control = control_function(inputs, torque + ca.vertcat(0, feedback))
    return Law("hip spring", control, base.breakpoints, table, {"stiffness": rows, "damping": rows + 1})


def wrong(robot, motion, torque_limit):
    return 3
"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "mylaw.py"
    path.write_text(SCRIPT)
    return path


@pytest.mark.slow
def test_a_law_of_one_script_is_tuned_saved_walked_and_exported(capsys, tmp_path, script):
    """Tuned, reloaded from the file of its gains, simulated, exported: one file outside of the package."""
    name, gains = f"{script}:hip_spring", str(tmp_path / "gains.json")
    code, text = run(capsys, "tune", GAIT, "--law", name, "--starts", "1", "-o", gains, "--json")
    facts = json.loads(text.out)
    assert code == 0, text.err
    assert facts["law"] == name
    assert set(facts["gains"]) == {"stiffness", "damping"}
    code, text = run(capsys, "stability", GAIT, "--law", gains, "--json")
    assert code == 0, text.err
    assert json.loads(text.out)["gaits"][0]["radius"] == pytest.approx(facts["radius_after"], rel=1e-9)
    assert run(capsys, "simulate", GAIT, "--law", name, "--gain", "stiffness=0.1", "--steps", "2")[0] == 0
    assert run(capsys, "export", GAIT, "--law", gains, "-o", str(tmp_path / "controller.c"))[0] == 0
    assert run(capsys, "export", GAIT, "--law", gains, "-o", str(tmp_path / "torques.json"))[0] == 0
    written = json.loads((tmp_path / "torques.json").read_text(encoding="utf-8"))
    assert written["gains"] == facts["gains"]


@pytest.mark.slow
def test_the_file_of_gains_finds_its_law_script_from_any_folder(capsys, tmp_path, monkeypatch, script, slip_gait):
    """The path of the script is relative to the file of gains, so that both may be moved together."""
    work, elsewhere = tmp_path / "work", tmp_path / "elsewhere"
    for folder in (work / "laws", work / "results", elsewhere):
        folder.mkdir(parents=True)
    script.rename(work / "laws" / "mylaw.py")
    monkeypatch.chdir(work)
    family = design_for(slip_gait, slip_gait.robot, "laws/mylaw.py:hip_spring", 8.0, False)
    options = GainSearchOptions(samples=0, starts=1, evaluations=1)
    tuned = tune_feedback(slip_gait, family, search=options, test=PushTest(starts=1))
    file = save_tuning(tuned, "results/gains.json")
    assert json.loads(file.read_text())["law"] == "../laws/mylaw.py:hip_spring"
    moved = shutil.move(work, elsewhere / "moved")
    gains = moved / "results" / "gains.json"
    for folder in (elsewhere, moved, moved / "laws"):
        monkeypatch.chdir(folder)
        found = design_for(slip_gait, slip_gait.robot, os.path.relpath(gains), None, False)
        assert found.law(tuned.gains).name == tuned.law.name
    (moved / "laws" / "mylaw.py").unlink()
    code, text = run(capsys, "simulate", str(Path(__file__).parents[2] / GAIT), "--law", str(gains))
    assert code == 2
    assert f"There is no law script {gains.parent / '../laws/mylaw.py'}" in " ".join(text.err.split())


def test_gains_of_a_law_that_has_changed_are_refused_or_remarked(capsys, tmp_path, script):
    """A renamed gain would be replaced by its default; another formula has another stability than the file states."""
    gains = str(tmp_path / "gains.json")
    options = ("--starts", "1", "--samples", "0", "--evaluations", "1")
    assert run(capsys, "tune", GAIT, "--law", f"{script}:hip_spring", *options, "-o", gains)[0] == 0
    assert "has changed" not in run(capsys, "show", gains)[1].out
    text = script.read_text()
    script.write_text(f"{text}\n# changed\n")
    code, said = run(capsys, "stability", GAIT, "--law", gains)
    assert code == 0
    assert f"has changed since the gains of {gains} were tuned" in " ".join(said.err.split())
    assert "its script has changed" in " ".join(run(capsys, "show", gains)[1].out.split())
    _warn_of_changed_script.cache_clear()
    said = "".join(run(capsys, "stability", GAIT, "--law", gains)[1].err for _ in range(2))
    assert said.count("has changed since the gains") == 1  # a command may make the law several times
    script.write_text(text.replace("stiffness", "rigidity"))
    for command in (("stability", GAIT), ("export", GAIT, "-o", str(tmp_path / "law.c")), ("tune", GAIT)):
        code, said = run(capsys, command[0], *command[1:], "--law", gains)
        assert code == 2
        text = " ".join(said.err.split())
        assert "has no gain 'stiffness', which was tuned." in text
        assert text.endswith(f"If the law has changed, tune it again: gaitopt tune GAIT --law {script}:hip_spring.")


def test_gains_tuned_for_another_gait_are_remarked_once(capsys, tmp_path, slip_gait):
    gains = tmp_path / "gains.json"
    options = ("--law", "pd", "--starts", "1", "--samples", "0", "--evaluations", "1", "--steps", "1")
    run(capsys, "tune", GAIT, *options, "-o", str(gains))
    assert "another gait" not in run(capsys, "stability", GAIT, "--law", str(gains))[1].err
    facts = json.loads(gains.read_text())
    assert facts["gait"]["parameters"]["friction"] == 0.14
    facts["gait"]["speed"], facts["gait"]["parameters"]["friction"] = 0.7, 0.2
    gains.write_text(json.dumps(facts))
    for command in (("stability", GAIT), ("tune", GAIT, *options[2:])):
        _warn_of_another_gait.cache_clear()
        said = run(capsys, *command, "--law", str(gains))[1].err
        assert said.count("were tuned for another gait (speed 0.7 m/s, friction 0.2)") == 1
        assert "this gait has speed 0.633 m/s, friction 0.14." in said
    del facts["gait"]  # a file of an earlier version
    gains.write_text(json.dumps(facts))
    assert "another gait" not in run(capsys, "stability", GAIT, "--law", str(gains))[1].err


def test_the_file_of_gains_of_an_earlier_version_finds_its_law_script(tmp_path, monkeypatch, script, slip_gait):
    """Its path is relative to the folder in which the law was tuned."""
    monkeypatch.chdir(tmp_path)
    family = design_for(slip_gait, slip_gait.robot, "mylaw.py:hip_spring", 8.0, False)
    options = GainSearchOptions(samples=0, starts=1, evaluations=1)
    tuned = tune_feedback(slip_gait, family, search=options, test=PushTest(starts=1))
    (tmp_path / "results").mkdir()
    file = save_tuning(tuned, "results/gains.json")
    file.write_text(file.read_text().replace("../mylaw.py", "mylaw.py"))
    assert load_tuning(file).family == "mylaw.py:hip_spring"
    assert load_tuning(file).gains == pytest.approx(tuned.gains)


def test_the_torque_limit_of_a_command_holds_for_the_law_of_a_script(script, slip_gait):
    first, far = slip_gait.motion.segments[0], np.array([0, 0, 100.0, 100.0])
    hips = [
        design_for(slip_gait, slip_gait.robot, f"{script}:hip_spring", limit, False)
        .law({})
        .torque_at(0.1, first.q[:, 0] + far, first.v[:, 0] + far)[1]
        for limit in (1000.0, 6.0)
    ]
    assert abs(hips[0]) > 6.5
    assert abs(hips[1]) == pytest.approx(6.0, abs=1e-9)


def test_a_script_without_a_law_is_explained(capsys, script):
    for name, message in (
        (f"{script}:wrong", "must return a Law or a ControllerFamily, but returned int"),
        (f"{script}:missing", "has no function missing"),
        (f"{script}:hip_sprng", "has no function hip_sprng. Did you mean 'hip_spring'? Known: hip_spring, wrong."),
        ("nowhere.py:law", "There is no law script nowhere.py"),
        ("pid", "There is no feedback law 'pid'"),
        ("mylaw:hip", "On the command line, SCRIPT.py:FUNCTION is a custom law, here 'mylaw.py:hip'."),
    ):
        code, text = run(capsys, "stability", GAIT, "--law", name)
        assert code == 2
        assert message in " ".join(text.err.split())


@pytest.mark.parametrize("gait", [GAIT, "docs/examples/heel_toe.h5"])
@pytest.mark.parametrize("verb", ["stability", "tune"])
def test_a_script_without_the_name_of_a_function_is_explained(capsys, script, gait, verb):
    for name, listed in ((script, f" Functions of {script}: hip_spring, wrong."), ("nowhere.py", "")):
        code, text = run(capsys, verb, gait, "--law", str(name), "--quiet")
        assert code == 2
        assert text.err == (
            f"Error: A custom law has the form SCRIPT.py:FUNCTION, got '{name}' without a function.{listed}\n"
        )


LAWS = """
import casadi as ca
import numpy as np

from gaitopt import Law, feedforward
from gaitopt.control import control_function, law_inputs


def without_gains(robot, motion, torque_limit):
    return feedforward(robot, motion)


def two(robot, motion):
    return feedforward(robot, motion)


def plain(t, q, v):
    return [0, -5 * q[2]]


def hip_only(robot, motion, torque_limit):
    i = law_inputs(robot, data=1)
    return Law("hip", control_function(i, i.data), np.zeros(1), np.ones((1, 1)), {"k": 0})


def falling(robot, motion, torque_limit):
    i = law_inputs(robot, data=1)
    control = control_function(i, ca.vertcat(50 * i.data, 0))
    return Law("falling", control, np.zeros(1), np.ones((1, 1)), {"k": 0})
"""


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (
            ("tune", GAIT, "--law", "laws.py:without_gains"),
            2,
            "has no gains to tune. Gains of a law with the decorator define_law are the arguments",
        ),
        (
            ("stability", GAIT, "--law", "laws.py:two"),
            2,
            "is not the function of a law: its arguments are (robot, motion)",
        ),
        (
            ("tune", GAIT, "--law", "laws.py:hip_only"),
            2,
            "laws.py returns 1 torque, but the robot has 2: ankle, hip.",
        ),
        (("stability", GAIT, "--law", "laws.py:plain"), 2, "Its arguments are (t, q, v); accepted are a"),
        (("stability", GAIT, "--law", "laws.py:falling"), 1, "No periodic gait of the walker under the law"),
    ],
)
def test_a_custom_law_that_cannot_be_used_ends_in_a_sentence(capsys, tmp_path, monkeypatch, arguments, status, message):
    (tmp_path / "laws.py").write_text(LAWS)
    command, gait, *rest = arguments
    gait = str(Path(gait).resolve())
    monkeypatch.chdir(tmp_path)
    code, text = run(capsys, command, gait, *rest)
    assert code == status
    assert message in " ".join(text.err.split())
    assert "search: at most" not in text.err  # no plan of a search that cannot begin


def test_a_law_tuned_in_python_is_read_if_its_family_names_the_script(capsys, script, slip_gait, tmp_path):
    """The file of a family without script states how the law is used: its function and the tuned gains."""
    name, gains = f"{script}:hip_spring", tmp_path / "gains.json"
    namespace = {}
    exec(SCRIPT, namespace)
    law = namespace["hip_spring"](slip_gait.robot, slip_gait.motion, np.inf)
    search, test = gaitopt.GainSearchOptions(samples=0, starts=1, evaluations=1), gaitopt.PushTest(starts=1, steps=1)
    tuned = tune_feedback(slip_gait, ControllerFamily.from_law(law), search=search, test=test)
    save_tuning(tuned, gains)
    code, text = run(capsys, "stability", GAIT, "--law", str(gains))
    assert code == 2
    message = " ".join(text.err.split())
    assert "The custom law 'hip spring' of" in message
    assert "use --law SCRIPT.py:FUNCTION --gain stiffness=0.2 --gain damping=0.1; or tune Controller" in message
    save_tuning(dataclasses.replace(tuned, family=name), gains)
    for options in ((name, "--gain", "stiffness=0.2", "--gain", "damping=0.1"), (str(gains),)):
        code, text = run(capsys, "stability", GAIT, "--law", *options, "--torque-limit", "1e6", "--json")
        assert json.loads(text.out)["gaits"][0]["radius"] == pytest.approx(tuned.radius_after, rel=1e-6)


def test_the_laws_in_the_help_are_those_of_the_registry():
    from gaitopt.cli.options import LawName
    from gaitopt.tuning.controller_family import FAMILIES

    (option,) = LawName.__metadata__
    assert option.help.startswith(f"Feedback law: {', '.join(FAMILIES)};")


def test_a_push_off_is_named_and_exported(capsys, tmp_path):
    path = tmp_path / "torques.json"
    options = ("--law", "push-off", "--gain", "push_off_torque=0.05", "--torque-limit", "8")
    assert run(capsys, "export", GAIT, *options, "-o", str(path))[0] == 0
    facts = json.loads(path.read_text(encoding="utf-8"))
    assert facts["gains"]["push_off_torque"] == 0.05
    assert facts["events"] == ["swing leg goes forward", "push-off begins", "push-off ends"]
    assert set(facts["latched"]) == {"waiting", "ready", "pushing", "done", "release time"}
    pushing = [bool(value) for value in facts["latched"]["pushing"]]
    assert any(pushing)
    assert not pushing[0]
    code, text = run(capsys, "stability", GAIT, *options, "--json")
    assert code == 0, text.err


def test_the_loss_of_friction_has_no_unit_1(capsys):
    margins = [
        {"kind": "friction patch", "survived": 0.05, "failed": 0.06, "unit": "1"},
        {"kind": "torque noise", "survived": 0.5, "failed": None, "unit": "N m"},
    ]
    print_endurance({"law": "lqr", "radius": 0.5, "survived": margins}, {})
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["friction", "patch", "0.05", "0.06", "coefficient", "of", "friction"] in lines
    assert ["torque", "noise", "0.5", "-", "N", "m"] in lines


@pytest.mark.parametrize(
    ("kind", "explained", "others"),
    [
        ("push", "A push is survived if the walker returns", ["other", "Slopes", "patch:", "noise:", "disturbance is"]),
        ("uphill slope", "A disturbance is survived if the walker completes", ["A push", "patch:", "noise:"]),
        ("friction patch", "Friction patch: decrease", ["A push", "Slopes", "noise:"]),
        ("torque noise", "Torque noise: standard", ["A push", "Slopes", "patch:"]),
    ],
)
def test_the_table_of_disturbances_explains_the_tested_kinds_only(capsys, kind, explained, others):
    margins = [{"kind": kind, "survived": 0.05, "failed": 0.06, "unit": "1"}]
    print_endurance({"law": "lqr", "radius": 0.5, "survived": margins}, {})
    text = " ".join(capsys.readouterr().out.split())
    assert explained in text
    assert [other for other in others if other in text] == []
