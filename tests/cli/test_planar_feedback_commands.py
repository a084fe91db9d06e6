"""The commands simulate, tune and push on optimal gaits of robots with several contacts."""

import functools
import json
import runpy
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitopt import Collocation, save
from gaitopt.cli.app import app
from gaitopt.cli.planar_law_option import PlanarLawOption
from gaitopt.control import by_phase_variable
from gaitopt.errors import InputError
from gaitopt.ocp import solve_planar
from gaitopt.stability import assess_planar
from gaitopt.stability.recovery import PushTest
from gaitopt.tuning import (
    GainSearchOptions,
    controller_family_named,
    load_tuning,
    planar_lqr,
    save_tuning,
    tune_feedback,
)
from tests.ocp.multicontact_examples import walk


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def gait():
    return solve_planar(walk(transcription=Collocation(intervals=10)))


@pytest.fixture(scope="module")
def file(gait, tmp_path_factory):
    return save(gait, tmp_path_factory.mktemp("walk") / "walk.h5")


@pytest.fixture(scope="module")
def tuned(gait):
    family = controller_family_named("joint_pd", gait.robot, gait, torque_limit=20.0)
    options = GainSearchOptions(samples=0, starts=1, evaluations=2)
    return tune_feedback(gait, family, search=options, test=PushTest(starts=1, steps=10, resolution=0.9))


def test_several_steps_of_a_gait_are_simulated_with_exchanged_legs(gait, file):
    result = run("simulate", file, "--steps", 3, "--json")
    facts = json.loads(result.stdout)
    assert (result.exit_code, facts["stop"], facts["steps"]) == (0, "steps_done", 3)
    assert facts["sequences"] == ["foot A stick |", "foot B stick |", "foot A stick |"]
    landings = [event for event in facts["events"] if event["names"][0].endswith("closes")]
    assert [event["names"][0] for event in landings] == ["foot B closes", "foot A closes", "foot B closes"]
    assert [event["time"] for event in landings] == pytest.approx([k * gait.period for k in (1, 2, 3)], abs=1e-6)


def test_a_walk_from_a_changed_state_under_a_law(gait, file):
    rate = gait.motion.segments[0].v[gait.robot.coordinates.index("a"), 0]
    state = f"a_rate={rate - 0.05}"
    result = run("simulate", file, "--steps", 2, "--law", "joint_pd", "--gain", "hip_stiffness=8", "--state", state)
    assert result.exit_code == 0, result.output
    fallen = run("simulate", file, "--steps", 2, "--state", "a_rate=0.5", "--json")
    facts = json.loads(fallen.stdout)
    assert fallen.exit_code == 1
    assert (facts["steps"], len(facts["sequences"])) == (0, 1)


def test_a_gait_is_simulated_on_another_ground(file):
    planned, same, changed = (
        json.loads(run("simulate", file, "--steps", 1, "--json", "--law", "joint_pd", *settings).stdout)
        for settings in ((), ("--set", "slope=0"), ("--set", "slope=0.002"))
    )
    assert same["events"] == planned["events"]
    assert changed["events"] != planned["events"]


def test_the_basin_of_a_gait_under_a_law(file, tmp_path):
    path = tmp_path / "basin.nc"
    options = ("--over", "a_rate=-0.733,0.5", "--law", "step_lqr", "--steps", 40, "--workers", 1, "-o", path)
    result = run("basin", file, *options, "--json")
    facts = json.loads(result.stdout)
    assert result.exit_code == 0, result.output
    assert facts["endings"] == ["foot A stick |", "fell"]
    assert facts["saved_gait"] == 0.5
    assert path.exists()
    assert "outside the axes" not in run("basin", file, *options).output
    far = run("basin", file, "--over", "a_rate=-0.5,0.5", "--workers", 1)
    assert "warning: the periodic gait is outside the axes: a_rate = -0.7329 [SI, rad]" in far.output


def test_gains_of_another_robot_are_refused_with_both_lists_of_actuators(tuned, file, tmp_path):
    limits = replace(tuned.settings, torque_limit={"ankle": 7.2, "hip": 7.2})
    gains = save_tuning(replace(tuned, settings=limits), tmp_path / "gains.json")
    message = "gains of a robot with the actuators ankle, hip, but compass_with_two_feet has ankle A, ankle B, hip"
    for command in ("stability", "tune"):
        assert message in str(run(command, file, "--law", gains).exception)


def test_tuned_gains_are_saved_and_reloaded(gait, tuned, tmp_path):
    path = save_tuning(tuned, tmp_path / "gains.json")
    read = load_tuning(path)
    assert set(read.gains) == {f"{name}_{kind}" for name in ("ankle A", "hip") for kind in ("stiffness", "damping")}
    law = read.law(gait.robot, gait)
    assert assess_planar(gait, law).radius == pytest.approx(tuned.radius_after, rel=1e-9)
    assert tuned.radius_after < tuned.radius_before
    assert tuned.verified.radius > 0
    option = PlanarLawOption(str(path), ["hip_stiffness=1.5"], None, False)
    changed = option.make(gait)
    assert changed.gain_values["hip_stiffness"] == 1.5
    assert changed.gain_values["hip_damping"] == law.gain_values["hip_damping"]


def test_gains_that_are_not_named_have_the_values_with_which_tuning_starts(gait):
    starts = {gain.name: gain.start for gain in controller_family_named("joint_pd", gait.robot, gait).gains}
    assert min(starts.values()) > 0
    law = PlanarLawOption("pd", ["hip_stiffness=8"], None, False).make(gait)
    values = {name: law.gain_values[name] for name in starts}
    assert values == pytest.approx(starts | {"hip_stiffness": 8.0}, rel=1e-12)


@pytest.mark.slow
def test_a_law_is_tuned_and_its_disturbances_are_found(file, tmp_path, monkeypatch):
    quick = functools.partial(GainSearchOptions, samples=0, starts=1, evaluations=2)
    monkeypatch.setattr("gaitopt.tuning.gain_search.GainSearchOptions", quick)
    gains = tmp_path / "gains.json"
    result = run("tune", file, "--law", "step_lqr", "--starts", 1, "-o", gains, "--json")
    facts = json.loads(result.stdout)
    assert (result.exit_code, set(facts["gains"])) == (0, {"angle", "rate"})
    result = run("push", file, "--law", gains, "--steps", 6, "--starts", 2, "--workers", 1, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert facts["radius"] == pytest.approx(json.loads(gains.read_text())["radius_after"], rel=1e-6)
    assert (len(facts["survived"]), facts["basin_after"]["starts"]) == (6, 2)


@pytest.mark.slow
def test_a_law_by_the_stance_angle_is_tuned_stored_simulated_and_exported(gait, file, tmp_path, monkeypatch):
    quick = functools.partial(GainSearchOptions, samples=0, starts=1, evaluations=2)
    monkeypatch.setattr("gaitopt.tuning.gain_search.GainSearchOptions", quick)
    gains, law = tmp_path / "gains.json", by_phase_variable(gait, planar_lqr(gait))
    result = run("tune", file, "--law", "lqr", "--stance-angle", "--starts", 1, "-o", gains, "--json")
    assert result.exit_code == 0, result.output
    stored = json.loads(gains.read_text())
    assert stored["stance_angle"] is True
    (assessed,) = json.loads(run("stability", file, "--law", gains, "--json").stdout)["gaits"]
    assert assessed["radius"] == pytest.approx(stored["radius_after"], rel=1e-6)
    angle, controller = ("--law", "lqr", "--stance-angle"), tmp_path / "controller.py"
    rate = gait.motion.segments[0].v[gait.robot.coordinates.index("a"), 0]
    result = run("simulate", file, *angle, "--steps", 2, "--state", f"a_rate={rate - 0.01}", "--json")
    assert json.loads(result.stdout)["stop"] == "steps_done"
    result = run("basin", file, *angle, "--over", f"a_rate={rate - 0.01},{rate}", "--workers", 1, "--json")
    assert json.loads(result.stdout)["saved_gait"] == 1.0
    assert run("export", file, *angle, "-o", controller).exit_code == 0
    q, v = (part[:, 0].tolist() for part in (gait.motion.segments[0].q, gait.motion.segments[0].v))
    exported = runpy.run_path(str(controller))["Controller"]()
    exported.begin(q, v)
    expected = law.parts[0].torque_at(0.0, np.array(q), np.array(v))
    assert exported.step(5.0, q, v) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("simulate", "--engine", "heyoca"), "There is no engine 'heyoca'. Did you mean 'heyoka'"),
        (("simulate", "--state", "knee=1"), "has no coordinate or rate 'knee'"),
        (("simulate", "--state", "a=0.3", "--state", "b=0.2", "--state", "y=1"), "No state near the gait"),
        (("simulate", "--state", "a=nan"), "must have finite values, got a = nan"),
        (("tune", "--law", "push_off"), "'push_off' is not available for robots with several contacts"),
        (("tune", "--law", "mine.py:law"), "There is no law script mine.py"),
        (
            ("tune", "--law", "step_lqr", "--torque-limit", 5),
            "'step_lqr' of a robot with several contacts accepts no torque",
        ),
        (("push", "--law", "computed_torque"), "There is no feedback law 'computed_torque' for a robot with several"),
        (("basin", "--over", "x=0:1:2"), "has no coordinate or parameter 'x'"),
    ],
)
def test_wrong_options_get_a_sentence(file, words, message):
    error = run(words[0], file, *words[1:]).exception
    assert isinstance(error, InputError)
    assert message in str(error)
