"""Tuned gains in files, and families of laws: tune, save, reload and walk."""

import json
import math
from dataclasses import replace

import pytest

from gaitopt import (
    ArchiveError,
    GainSearchOptions,
    InputError,
    PushTest,
    assess_stability,
    compass_biped,
    joint_pd,
    tune_feedback,
)
from gaitopt.cli.feedback_output import print_tuning, verification_text
from gaitopt.cli.result_output import find_facts, print_result
from gaitopt.tuning import ControllerFamily, controller_family_named, load_tuning, save_tuning
from gaitopt.tuning.gain_units import format_gains


@pytest.fixture(scope="module")
def tuned(slipping):
    robot = compass_biped()
    design = controller_family_named("pd", robot, slipping.motion, torque_limit={"ankle": 7.0, "hip": 8.0})
    design = design.by_stance_angle(robot, slipping.motion)
    design = design.with_bounds({"hip_stiffness": (0, 60), "hip_damping": (0, 20)})
    search, test = GainSearchOptions(samples=0, starts=1, evaluations=4), PushTest(starts=1, resolution=0.9)
    return tune_feedback(slipping, design, search=search, test=test)


def test_a_saved_tuning_makes_the_same_law(slipping, tuned, tmp_path):
    loaded = load_tuning(save_tuning(tuned, tmp_path / "gains.json"))
    assert set(loaded.gains) == {"ankle_stiffness", "ankle_damping", "hip_stiffness", "hip_damping"}
    assert loaded.settings.torque_limit == {"ankle": 7.0, "hip": 8.0}
    law = loaded.law(compass_biped(), slipping.motion)
    assert law.digest() == tuned.law.digest()
    assert assess_stability(slipping, law).radius == tuned.radius_after == loaded.radius


def test_show_states_the_verification_and_the_limits_of_a_file(tuned, tmp_path, capsys):
    path = save_tuning(tuned, tmp_path / "gains.json")
    print_result(load_tuning(path))
    shown = " ".join(capsys.readouterr().out.split())
    ball = tuned.verified.radius
    assert ball
    print_tuning(tuned)
    announced = " ".join(capsys.readouterr().out.split())
    words = verification_text(tuned.verified)
    assert "in at most" in words
    assert words in shown
    assert words in announced
    assert "torque limits ankle 7 N m, hip 8 N m" in shown
    gains = format_gains(tuned.family, load_tuning(path).gains)
    assert "N m/rad" in gains
    assert f"gains {gains} spectral" in shown
    assert load_tuning(path).actuator_units == {"ankle": "N m", "hip": "N m"}
    several = replace(load_tuning(path), several_contacts=True, actuator_units={})  # of an earlier version
    print_result(several)
    shown = " ".join(capsys.readouterr().out.split())
    assert "torque limits ankle 7 N m or N, hip 8 N m or N" in shown
    assert "N m/rad" not in shown
    assert find_facts(load_tuning(path))["verified"]["push_radius"] == ball
    facts = json.loads(path.read_text(encoding="utf-8"))
    for name in ("steps", "tolerance", "settling", "beyond"):  # as in a file of an earlier version
        del facts["verified"][name]
    path.write_text(json.dumps(facts), encoding="utf-8")
    print_result(load_tuning(path))
    shown = " ".join(capsys.readouterr().out.split())
    assert f"starts within {ball:.4g} rad/s return to the gait; so few starts" in shown
    facts["verified"]["push_radius"] = 0.0
    path.write_text(json.dumps(facts), encoding="utf-8")
    print_result(load_tuning(path))
    assert "no: in each tested ball of pushes, the start does not return" in " ".join(capsys.readouterr().out.split())
    facts["verified"]["interrupted"] = True
    path.write_text(json.dumps(facts), encoding="utf-8")
    print_result(load_tuning(path))
    assert "no: the verification was interrupted before all" in " ".join(capsys.readouterr().out.split())
    facts["search_interrupted"] = True
    path.write_text(json.dumps(facts), encoding="utf-8")
    print_result(load_tuning(path))
    assert "no: the search was interrupted" in " ".join(capsys.readouterr().out.split())


def test_the_file_is_open(tuned, tmp_path):
    facts = json.loads(save_tuning(tuned, tmp_path / "gains.json").read_text(encoding="utf-8"))
    assert (facts["format"], facts["law"], facts["stance_angle"]) == ("gaitopt tuned gains", "joint_pd", True)
    assert facts["tuned"] == ["hip_stiffness", "hip_damping"]
    assert min(trial["objective"] for trial in facts["trials"]) == pytest.approx(facts["radius_after"], abs=1e-5)
    assert len(facts["multipliers"]) == 4


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{}", "the entry 'format' is missing"),
        ("no json", "it is not JSON text"),
        ('{"format": "gaitopt torques", "format_version": 1}', "it contains gaitopt torques of version 1"),
        ("[]", "an entry has an invalid type"),
    ],
)
def test_other_files_are_refused(tmp_path, text, reason):
    path = tmp_path / "gains.json"
    path.write_text(text)
    with pytest.raises(ArchiveError, match=f"expected the format 'gaitopt tuned gains', version 1, .*; {reason}"):
        load_tuning(path)


def test_other_names_are_refused(tuned, tmp_path):
    with pytest.raises(InputError, match=r"\.json"):
        save_tuning(tuned, tmp_path / "gains.h5")
    with pytest.raises(InputError, match="no file"):
        load_tuning(tmp_path / "nowhere.json")


def test_the_family_of_a_law_has_its_gains(slipping):
    law = joint_pd(compass_biped(), slipping.motion, stiffness=20, torque_limit=8)
    design = ControllerFamily.from_law(law)
    assert [(gain.name, gain.lower, gain.start, gain.upper) for gain in design.gains] == [
        ("ankle_stiffness", 0.0, 20.0, 60.0),
        ("hip_stiffness", 0.0, 20.0, 60.0),
    ]
    assert design.law({"hip_stiffness": 5.0}).gain_values["hip_stiffness"] == 5.0


SPRING = """
from gaitopt import joint_pd


def spring(robot, motion, torque_limit):
    return joint_pd(robot, motion, stiffness=20.0, damping=4.0, torque_limit=torque_limit)


def two_arguments(robot, motion):
    return spring(robot, motion, 8.0)
"""


@pytest.fixture
def file_of_script(slipping, tmp_path):
    law = joint_pd(compass_biped(), slipping.motion, stiffness=20.0, damping=4.0, torque_limit=8.0)

    def save_with_name(name):
        family = ControllerFamily.from_law(law, name=name)
        search, test = GainSearchOptions(samples=0, starts=1, evaluations=1), PushTest(starts=1, resolution=0.9)
        return save_tuning(tune_feedback(slipping, family, search=search, test=test), tmp_path / "gains.json")

    return save_with_name


def test_the_law_of_a_script_is_made_by_its_function(slipping, tmp_path, file_of_script, monkeypatch):
    (tmp_path / "mylaw.py").write_text(SPRING)
    tuned = load_tuning(file_of_script(f"{tmp_path / 'mylaw.py'}:spring"))
    monkeypatch.chdir(tmp_path.parent)
    law = tuned.law(compass_biped(), slipping.motion)
    assert law.gain_values == pytest.approx(dict(tuned.gains))
    (tmp_path / "mylaw.py").unlink()
    with pytest.raises(InputError, match=r"mylaw\.py, which is missing; pass its family .*family=ControllerFamily"):
        tuned.law(compass_biped(), slipping.motion)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mylaw.py:two_arguments", r"two_arguments is not the function of a law: its arguments are \(robot, motion\)"),
        ("mylaw.py:sprng", "has no function sprng. Did you mean 'spring'"),
        ("my spring", r"'my spring' was tuned in Python; pass its family .*family=ControllerFamily\.from_law"),
    ],
)
def test_a_custom_law_that_is_not_found_states_the_remedy(slipping, tmp_path, file_of_script, name, message):
    (tmp_path / "mylaw.py").write_text(SPRING)
    tuned = load_tuning(file_of_script(str(tmp_path / name) if ".py" in name else name))
    with pytest.raises(InputError, match=message):
        tuned.law(compass_biped(), slipping.motion)


@pytest.mark.parametrize(
    ("limit", "units", "text"),
    [
        (150.0, {"hip": "N m", "knee": "N m"}, "150 N m"),
        (150.0, {"hip": "N m", "leg": "N"}, "150 N m (hip), 150 N (leg)"),
        ({"hip": 9.0, "leg": 300.0}, {"hip": "N m", "leg": "N"}, "hip 9 N m, leg 300 N"),
        (math.inf, {"hip": "N m", "leg": "N"}, "none"),
        (150.0, {}, "150 N m or N"),
    ],
)
def test_each_torque_limit_has_the_unit_of_its_actuator(tuned, tmp_path, capsys, limit, units, text):
    settings = replace(tuned.settings, torque_limit=limit)
    path = save_tuning(replace(tuned, settings=settings, actuator_units=units), tmp_path / "gains.json")
    print_result(replace(load_tuning(path), several_contacts=True))
    assert f"torque limits {text} objective" in " ".join(capsys.readouterr().out.split())
