"""Serialised robots: restored they are the same robot; damaged, newer and custom ones are refused with a sentence."""

import copy
import dataclasses
import json
import math
import pickle
import random
import subprocess
import sys

import casadi as ca
import numpy as np
import pytest

from gaitopt import ArchiveError, InputError, Parameter, compass_biped, rimless_wheel
from gaitopt.cli.script import load_script
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.model.physics import find_differences, physics_of
from gaitopt.model.robot import Robot
from gaitopt.model.robot_record import RobotRecord, describe_parameter, read_parameter
from gaitopt.model.robot_serialisation import read_fields
from tests.conftest import ROOT
from tests.walkers import round_compass, torso_biped

ROBOTS = {
    "compass biped": compass_biped,
    "rimless wheel": rimless_wheel,
    "five links": lambda: load_script(ROOT / "problems" / "five_link.py")().robot,
    "torso": torso_biped,
    "round feet": lambda: round_compass(0.3),
}


class Sticky(PlasticFrictional):
    """An impact law of a user."""


def restored(robot):
    """Return a robot from its record, not the object that this process has already."""
    return Robot(**read_fields(robot.record))


@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS.keys())
def test_a_restored_robot_is_the_same_in_every_field_and_bit(make, rng):
    robot = make()
    other = restored(robot)
    for entry in dataclasses.fields(Robot):
        one, two = getattr(robot, entry.name), getattr(other, entry.name)
        if entry.name == "acceleration":
            assert list(one) == list(two)
        pairs = zip(one.values(), two.values(), strict=True) if entry.name == "acceleration" else [(one, two)]
        for a, b in pairs:
            if not isinstance(a, ca.Function):
                assert a == b
                continue
            assert (a.name(), a.name_in(), a.name_out()) == (b.name(), b.name_in(), b.name_out())
            inputs = [rng.normal(size=a.size_in(i)) for i in range(a.n_in())]
            for here, there in zip(a.call(inputs), b.call(inputs), strict=True):
                np.testing.assert_array_equal(np.asarray(here), np.asarray(there))
    assert find_differences(physics_of(robot), other) == ()
    assert other.record.digest == robot.record.digest


def test_a_process_has_one_object_for_a_robot():
    robot = torso_biped()
    assert Robot.from_record(robot.record) is robot
    assert pickle.loads(pickle.dumps(robot)) is robot
    assert copy.deepcopy(robot) is robot
    assert robot.record is robot.record


def test_another_process_has_one_object_for_a_robot(tmp_path):
    """Pickled twice, it is compiled once there."""
    file = tmp_path / "robots"
    file.write_bytes(pickle.dumps(pickle.dumps(torso_biped())))
    text = (
        "import pickle, pathlib, sys\n"
        "packed = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "one, two = pickle.loads(packed), pickle.loads(packed)\n"
        "assert one is two\n"
        "print(one.name, one.n_q, one.record.digest)\n"
    )
    ran = subprocess.run([sys.executable, "-c", text, file], capture_output=True, text=True, cwd=ROOT, check=True)
    assert ran.stdout.split() == ["torso_biped", "5", torso_biped().record.digest]


def test_a_parameter_is_the_same_again():
    every = [parameter for make in ROBOTS.values() for parameter in make().parameters]
    every.append(Parameter("whole", 3, "1", "count", lower=1, whole=True, infinite=True, at_most="friction"))
    for parameter in every:
        described = json.loads(json.dumps(describe_parameter(parameter), allow_nan=False))
        assert read_parameter(described) == parameter
    assert any(math.isinf(parameter.default) for parameter in every)


def test_a_record_is_small():
    """Beside 130 kB of a gait."""
    assert len(compass_biped().record.compressed) < 20_000


def test_a_custom_impact_law_is_not_restored_but_taken_when_given():
    model = ContactModel(impact=Sticky())
    robot = torso_biped().with_contact_model(model)
    with pytest.raises(InputError, match=r"custom class 'tests\.model\.test_robot_record:Sticky'.*--problem"):
        read_fields(robot.record)
    assert read_fields(robot.record, model)["contact_model"] is model
    assert pickle.loads(pickle.dumps(robot)) is robot
    assert Robot.from_record(robot.record, ContactModel(impact=Sticky())).contact_model == model


def damages(text, count):
    """Yield damaged texts: shorter, with another character, with many others."""
    generator = random.Random(1)
    for number in range(count):
        changed = bytearray(text)
        place = generator.randrange(len(text))
        if number % 3 == 0:
            yield bytes(changed[:place])
            continue
        for _ in range(1 if number % 3 == 1 else 50):
            place = generator.randrange(len(text))
            changed[place] = (changed[place] + generator.randrange(1, 255)) % 256
        yield bytes(changed)


def test_a_damaged_text_is_refused_before_casadi_reads_it(monkeypatch):
    """CasADi ends the process with a segmentation fault on one damaged Function in ten, and reads others wrongly."""
    monkeypatch.setattr(ca.Function, "deserialize", lambda text: pytest.fail("a damaged text was read"))
    record = compass_biped().record
    for text in damages(record.text, 60):
        with pytest.raises(
            ArchiveError,
            match=r"stored robot 'compass_biped' is damaged: its text does not have the stored SHA-256 digest",
        ):
            read_fields(RobotRecord(record.name, text, record.digest, record.casadi))


def test_a_robot_of_a_newer_casadi_is_refused_with_both_versions(monkeypatch):
    """The error is that of CasADi 3.7 for a Function that 3.8 wrote."""

    def refuse(text):
        raise RuntimeError(
            ".../serializing_stream.cpp:372: Assertion failed:\n"
            "DeSerialization of FunctionInternal failed. Object written in version 9 but can only read version 1...6."
        )

    monkeypatch.setattr(ca.Function, "deserialize", refuse)
    record = dataclasses.replace(compass_biped().record, casadi="99.1.0")
    with pytest.raises(ArchiveError) as caught:
        read_fields(record)
    told = str(caught.value)
    assert f"CasADi 99.1.0 wrote it and CasADi {ca.__version__} is installed" in told
    assert "Object written in version 9" in told
    assert "Install CasADi 99.1.0 or newer, or specify the robot" in told
