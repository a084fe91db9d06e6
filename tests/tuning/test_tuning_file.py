"""Tuned gains in files, and families of laws: tune, save, reload and walk."""

import json

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
from gaitopt.tuning import ControllerFamily, controller_family_named, load_tuning, save_tuning


@pytest.fixture(scope="module")
def tuned(slipping):
    robot = compass_biped()
    design = controller_family_named("pd", robot, slipping.motion, torque_limit={"ankle": 7.0, "hip": 8.0})
    design = design.by_stance_angle(robot, slipping.motion)
    design = design.bounded({"hip_stiffness": (0, 60), "hip_damping": (0, 20)})
    search, test = GainSearchOptions(samples=0, starts=1, evaluations=4), PushTest(starts=1, resolution=0.9)
    return tune_feedback(slipping, design, search=search, test=test)


def test_a_saved_tuning_makes_the_same_law(slipping, tuned, tmp_path):
    loaded = load_tuning(save_tuning(tuned, tmp_path / "gains.json"))
    assert set(loaded.gains) == {"ankle_stiffness", "ankle_damping", "hip_stiffness", "hip_damping"}
    assert loaded.settings.torque_limit == {"ankle": 7.0, "hip": 8.0}
    law = loaded.law(compass_biped(), slipping.motion)
    assert law.digest() == tuned.law.digest()
    assert assess_stability(slipping, law).radius == tuned.radius_after == loaded.radius


def test_the_file_is_open(tuned, tmp_path):
    facts = json.loads(save_tuning(tuned, tmp_path / "gains.json").read_text(encoding="utf-8"))
    assert (facts["format"], facts["law"], facts["stance_angle"]) == ("gaitopt tuned gains", "joint_pd", True)
    assert facts["tuned"] == ["hip_stiffness", "hip_damping"]
    assert min(trial["objective"] for trial in facts["trials"]) == pytest.approx(facts["radius_after"], abs=1e-5)
    assert len(facts["multipliers"]) == 4


@pytest.mark.parametrize("text", ["{}", "no json", '{"format": "gaitopt torques", "format_version": 1}', "[]"])
def test_other_files_are_refused(tmp_path, text):
    path = tmp_path / "gains.json"
    path.write_text(text)
    with pytest.raises(ArchiveError, match="expected the format 'gaitopt tuned gains', version 1"):
        load_tuning(path)


def test_other_names_are_refused(tuned, tmp_path):
    with pytest.raises(InputError, match=r"\.json"):
        save_tuning(tuned, tmp_path / "gains.h5")
    with pytest.raises(InputError, match="no file"):
        load_tuning(tmp_path / "nowhere.json")


def test_the_family_of_a_law_has_its_gains(slipping):
    law = joint_pd(compass_biped(), slipping.motion, stiffness=20, torque_limit=8)
    design = ControllerFamily.of(law)
    assert [(gain.name, gain.lower, gain.start, gain.upper) for gain in design.gains] == [
        ("ankle_stiffness", 0.0, 20.0, 60.0),
        ("hip_stiffness", 0.0, 20.0, 60.0),
    ]
    assert design.law({"hip_stiffness": 5.0}).gain_values["hip_stiffness"] == 5.0
