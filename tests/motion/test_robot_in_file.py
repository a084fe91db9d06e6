"""A gait carries its robot: files restore it, older ones name it, and another robot is refused by its physics."""

import dataclasses
import pickle
import subprocess
import sys

import h5py
import numpy as np
import pytest

from gaitopt import ArchiveError, InputError, assess_stability, compass_biped, load, save, verify
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.model.robot import Robot
from gaitopt.model.robots.catalogue import CATALOGUE
from gaitopt.motion.archive import read_gait, write_gait
from tests.conftest import ROOT
from tests.hdf5 import edit_hdf5
from tests.model.test_physics import biped
from tests.walkers import torso_biped

EXAMPLE = ROOT / "docs" / "examples" / "compass_slip.h5"
OLD = ROOT / "tests" / "motion" / "compass_slip_version_2.h5"


class Sticky(PlasticFrictional):
    """An impact law of a user."""


@pytest.fixture
def custom_file(slip_gait, tmp_path):
    """The example as a gait of a robot that no catalogue has."""
    return save(slip_gait.with_robot(biped("mine")), tmp_path / "custom.h5")


def run(program, *arguments):
    """Return what a program prints in a separate process."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def test_the_robot_of_the_catalogue_is_used_itself():
    gait = load(EXAMPLE)
    assert gait.robot_name == "compass_biped"
    assert gait.robot is compass_biped()


@pytest.mark.slow
def test_a_custom_robot_is_restored_in_another_process(custom_file):
    program = (
        "import sys\n"
        "from gaitopt import assess_stability, load, verify\n"
        "gait, again = load(sys.argv[1]), load(sys.argv[1])\n"
        "assert gait.robot is again.robot\n"
        "print(gait.robot_name, verify(gait).verification.passed, repr(assess_stability(gait).radius))\n"
    )
    name, passed, radius = run(program, custom_file).split()
    assert (name, passed) == ("mine", "True")
    assert float(radius) == pytest.approx(assess_stability(load(EXAMPLE)).radius, rel=1e-6)


def test_no_robot_is_restored_to_look_at_a_gait(custom_file):
    program = (
        "import sys\n"
        "from gaitopt import load, save\n"
        "gait = load(sys.argv[1])\n"
        "print(gait, gait.speed, gait.energy)\n"
        "save(gait, sys.argv[1])\n"
        "assert 'casadi' not in sys.modules\n"
    )
    assert "Gait('mine'" in run(program, custom_file)
    assert verify(load(custom_file)).verification.passed


def test_a_saved_robot_is_not_changed_by_loading_and_saving(custom_file, tmp_path):
    copy = save(load(custom_file), tmp_path / "copy.h5")
    with h5py.File(custom_file) as one, h5py.File(copy) as two:
        assert dict(one["robot"].attrs) == dict(two["robot"].attrs)
        for name in ("model", "points", "values"):
            np.testing.assert_array_equal(one["robot"][name][...], two["robot"][name][...])


def test_a_file_of_version_2_gives_the_same_gait_as_one_with_the_robot():
    old, new = load(OLD), load(EXAMPLE)
    assert old.robot is new.robot
    assert old.problem == new.problem
    assert verify(old).verification == verify(new).verification
    for one, two in zip(old.motion.segments, new.motion.segments, strict=True):
        for entry in dataclasses.fields(one):
            np.testing.assert_array_equal(getattr(one, entry.name), getattr(two, entry.name))
    for kind in ("unknowns", "constraints"):
        for name, table in getattr(old.solution, kind).items():
            np.testing.assert_array_equal(table.values, getattr(new.solution, kind)[name].values)
            np.testing.assert_array_equal(table.multipliers, getattr(new.solution, kind)[name].multipliers)


def test_an_old_file_of_an_unknown_robot_is_refused_at_use(tmp_path, write_old_file):
    gait = load(write_old_file(tmp_path / "old.h5", "mine"))
    assert gait.robot_name == "mine"
    assert gait.speed > 0
    for use in (verify, assess_stability, lambda gait: gait.robot):
        with pytest.raises(
            InputError, match=r"contains only the name of its robot, 'mine'.*gait\.with_robot.*--problem SCRIPT\.py"
        ):
            use(gait)
    again = load(save(gait, tmp_path / "again.h5"))
    with pytest.raises(InputError, match="contains only the name of its robot"):
        verify(pickle.loads(pickle.dumps(again)))


def test_an_old_file_takes_only_a_robot_that_has_its_motion(tmp_path, write_old_file):
    gait = load(write_old_file(tmp_path / "old.h5", "mine"))
    assert load(save(gait.with_robot(biped("mine")), tmp_path / "new.h5")).robot.name == "mine"
    with pytest.raises(InputError, match=r"'mine' of the gait\. It differs in: total mass, kinetic energy, potential"):
        gait.with_robot(biped("mine", mass=1.01))
    with pytest.raises(
        InputError,
        match=r"angles and actuators \(th1, th2, th3, stance hip, swing hip instead of th1,",
    ):
        gait.with_robot(torso_biped())


def test_an_edited_robot_of_the_catalogue_is_not_used_for_old_files(tmp_path, write_old_file, monkeypatch):
    monkeypatch.setitem(CATALOGUE, "compass_biped", lambda: biped("compass_biped", mass=1.01))
    with pytest.raises(InputError, match=r"is not the robot 'compass_biped' of the gait\. It differs in: total mass"):
        verify(load(write_old_file(tmp_path / "old.h5")))


def test_an_edited_robot_of_the_catalogue_is_not_used_for_new_files(slip_gait, tmp_path, monkeypatch):
    gait = slip_gait.with_robot(biped("compass_biped"))  # another object and digest, no drawing of the legs
    monkeypatch.setitem(CATALOGUE, "compass_biped", lambda: biped("compass_biped", mass=1.01))
    verified = verify(load(save(gait, tmp_path / "gait.h5")))
    assert verified.verification.passed


def test_physics_decide_and_not_names(slip_gait, compass):
    renamed = slip_gait.with_robot(biped("other name"))
    assert renamed.robot.name == "other name"
    assert renamed.with_robot(compass).robot is compass
    with pytest.raises(InputError) as caught:
        slip_gait.with_robot(biped("compass_biped", mass=1.01))
    told = str(caught.value)
    assert "The robot 'compass_biped' is not the robot 'compass_biped' of the gait." in told
    assert "It differs in: total mass (by 0.41 %), mass matrix (by " in told
    assert told.count(" %)") == 3
    assert " more. Use the robot with which the gait was computed, or solve the problem again with this one." in told


def test_another_impact_law_is_another_robot(slip_gait, compass):
    sticky = compass.with_contact_model(ContactModel(impact=Sticky()))
    with pytest.raises(InputError, match="It differs in: impact law or contact transitions"):
        slip_gait.with_robot(sticky)


def test_a_custom_impact_law_must_be_given_again(slip_gait, compass, tmp_path):
    sticky = dataclasses.replace(compass, name="sticky").with_contact_model(ContactModel(impact=Sticky()))
    path = save(dataclasses.replace(slip_gait, robot=sticky), tmp_path / "gait.h5")
    assert load(path).robot is sticky  # this process has its code
    program = (
        "import sys\n"
        "from gaitopt import InputError, load, verify\n"
        "gait = load(sys.argv[1])\n"
        "try:\n"
        "    verify(gait)\n"
        "except InputError as error:\n"
        "    print(error)\n"
    )
    assert "test_robot_in_file:Sticky', which a file cannot contain. Specify the robot" in run(program, path)


@pytest.mark.parametrize("place", [0, 1000, 100_000])
def test_a_damaged_robot_is_refused_at_use_and_the_numbers_are_read(custom_file, place):
    with edit_hdf5(custom_file) as file:
        file["robot/model"][place] ^= 1
        file["robot"].attrs["name"] = "mine"
    program = (
        "import sys\n"
        "from gaitopt import ArchiveError, load, verify\n"
        "gait = load(sys.argv[1])\n"
        "print(gait.speed)\n"
        "try:\n"
        "    verify(gait)\n"
        "except ArchiveError as error:\n"
        "    print(error)\n"
    )
    speed, told = run(program, custom_file).splitlines()
    assert float(speed) > 0
    assert told.startswith("The stored robot 'mine' is damaged")
    damaged = load(custom_file)
    assert damaged.with_robot(biped("mine")).robot.name == "mine"


def test_a_damaged_robot_does_no_harm_to_intact_files(custom_file, tmp_path, slip_gait):
    intact = save(slip_gait.with_robot(biped("mine")), tmp_path / "intact.h5")
    with edit_hdf5(custom_file) as file:
        file["robot/model"][5000] ^= 1
    program = (
        "import sys\n"
        "from gaitopt import load, verify\n"
        "damaged = load(sys.argv[1])\n"
        "print(verify(load(sys.argv[2])).verification.passed)\n"
    )
    assert run(program, custom_file, intact).strip() == "True"


def test_a_robot_of_a_newer_casadi_can_be_given(slip_gait, tmp_path, monkeypatch):
    """The physics are beside it and show whether it is the same."""
    path = save(slip_gait.with_robot(biped("mine", order=-1)), tmp_path / "newer.h5")

    def refuse(record, contact_model=None):
        raise ArchiveError("Object written in version 9")

    monkeypatch.setattr("gaitopt.model.robot.read_fields", refuse)
    monkeypatch.setattr("gaitopt.model.robot._RESTORED", {})
    gait = load(path)
    with pytest.raises(ArchiveError, match="Object written in version 9"):
        verify(gait)
    assert verify(gait.with_robot(biped("mine"))).verification.passed
    with pytest.raises(InputError, match="It differs in: total mass"):
        gait.with_robot(biped("mine", mass=2))


def test_a_file_that_other_tools_have_packed_again_is_read(custom_file):
    with edit_hdf5(custom_file) as file:
        model = file["robot/model"][...]
        del file["robot/model"]
        file["robot"].create_dataset("model", data=model, chunks=(1000,), shuffle=True)
    assert verify(load(custom_file)).verification.passed


@pytest.mark.slow
def test_many_gaits_in_a_file_share_a_robot(tmp_path, slip_gait):
    """A thousand gaits of a sweep have one robot, in the file and in memory."""
    sizes = []
    for count in (1, 41):
        with h5py.File(tmp_path / "many.h5", "w") as file:
            shared = {}
            for number in range(count):
                robot = (compass_biped(), torso_biped())[number % 2]
                write_gait(file.create_group(f"gait {number}"), dataclasses.replace(slip_gait, robot=robot), shared)
        sizes.append((tmp_path / "many.h5").stat().st_size)
    alone = save(slip_gait, tmp_path / "one.h5").stat().st_size
    record = len(compass_biped().record.compressed)
    assert (sizes[1] - sizes[0]) / 40 < alone - record
    with h5py.File(tmp_path / "many.h5") as file:
        assert file["gait 0/robot"] == file["gait 2/robot"]
        assert file["gait 0/robot"] != file["gait 1/robot"]
        gaits = [read_gait(file[f"gait {number}"]) for number in range(4)]
    assert gaits[0].robot_source is gaits[2].robot_source
    assert [gait.robot.name for gait in gaits] == ["compass_biped", "torso_biped"] * 2


def test_a_gait_in_another_process_has_the_robot_of_this_one(custom_file):
    gait = load(custom_file)
    sent = pickle.loads(pickle.dumps(gait))
    assert sent.robot is gait.robot
    assert isinstance(sent.robot, Robot)
    solved = dataclasses.replace(gait, robot=torso_biped())
    assert pickle.loads(pickle.dumps(solved)).robot is solved.robot
