"""Files of gaits of robots with several contacts: what is saved is what is loaded, with its robot."""

import dataclasses
import json
import subprocess
import sys

import h5py
import numpy as np
import pytest

from gaitopt import ArchiveError, InputError, load, save, verify
from gaitopt.model import Terrain
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.robots.spoked_wheel import spoked_wheel
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.motion import PhaseSequence, PlanarGait, SolverReport
from gaitopt.motion.versions import versions
from gaitopt.simulation import simulate_planar
from gaitopt.status import Status
from tests.conftest import ROOT
from tests.hdf5 import edit_hdf5
from tests.motion.test_archive_round_trip import assert_same

FALLS = {
    "monopod": (monopod, [0, 0.7, 0, 0, 0.6], [1.0, 0, 0, 0, 0]),
    "vertical_hopper": (vertical_hopper, [0.7, 0.2], [0, 0]),
    "kneed_walker": (kneed_walker, [0, 1.02, 0.2, 0.1, -0.2, 0.1], [0.5, 0, -1, 0, 0, 0]),
    "compass_with_two_feet": (compass_with_two_feet, [0, 1.7, 0.2, -0.3], [0.5, 0, -1, 0]),
    "round_foot_walker": (round_foot_walker, [0, 1.2, 0.2, -0.2], [0.2, 0, -0.2, -0.2]),
    "spoked_wheel": (spoked_wheel, [0, 1.2, 0.1], [0.3, 0, 0.2]),
}
"""A robot, coordinates and rates from which it falls on its feet."""

EMPTY_REPORT = {
    "iterations": 0,
    "objective": 0.0,
    "constraint_violation": 0.0,
    "error_between_nodes": 0.0,
    "build_seconds": 0.0,
    "solve_seconds": 0.0,
    "message": "simulated",
}


def make_gait(robot, motion):
    """Return a motion as a gait that was not optimised."""
    return PlanarGait(
        robot=robot,
        sequence=PhaseSequence.parse("flight |"),
        status=Status.SOLVED,
        motion=motion,
        problem={"objective": "none", "objective_unit": "1"},
        solver=SolverReport(**EMPTY_REPORT),
        versions=versions(),
    )


@pytest.fixture(scope="module", params=FALLS)
def fall(request):
    make, q, v = FALLS[request.param]
    robot = make()
    return make_gait(robot, simulate_planar(robot, q, v, {"friction": 0.3}, duration=0.3).motion)


@pytest.fixture
def path(hop_gait, tmp_path):
    return save(hop_gait, tmp_path / "hop.h5")


def test_the_motion_of_every_robot_comes_back(fall, tmp_path):
    assert fall.motion.events
    assert_same(load(save(fall, tmp_path / "fall.h5")), fall)


def test_the_terrain_of_a_motion_comes_back(tmp_path):
    make, q, v = FALLS["monopod"]
    terrain = Terrain(steps=[(0.0, -0.02)], patches=[(-1, 1, 0.1)])
    motion = simulate_planar(make(), q, v, {"friction": 0.3, "terrain": terrain}, duration=0.3).motion
    loaded = load(save(make_gait(make(), motion), tmp_path / "terrain.h5")).motion
    assert loaded.terrain == terrain


def test_an_optimised_gait_comes_back(hop_gait, path):
    assert_same(load(path), hop_gait)


def test_saving_what_was_loaded_changes_nothing(path, tmp_path):
    assert_same(load(save(load(path), tmp_path / "again.h5")), load(path))


def test_every_dataset_has_a_unit(path):
    with h5py.File(path) as file:
        datasets = []
        file.visititems(lambda name, part: datasets.append(part) if isinstance(part, h5py.Dataset) else None)
        assert all(dataset.attrs["unit"] for dataset in datasets)
        assert file["motion/segments/0000/q"].attrs["unit"] == "m, m, rad, rad, m"
        assert file["motion/segments/0000/torque"].attrs["unit"] == "N, N m"
        assert json.loads(file["motion/segments/0000"].attrs["modes"]) == {"foot": "stick", "hip point": "free"}


def test_files_of_other_gaits_keep_their_version(slip_gait, path, tmp_path):
    """Older releases read them."""
    with h5py.File(save(slip_gait, tmp_path / "slip.h5")) as other, h5py.File(path) as file:
        assert (other.attrs["format_version"], file.attrs["format_version"]) == (5, 5)


def test_the_robot_is_restored_in_another_process_and_verifies(path):
    program = (
        "import sys\n"
        "from gaitopt import load, verify\n"
        "gait, again = load(sys.argv[1]), load(sys.argv[1])\n"
        "assert gait.robot is again.robot\n"
        "print(gait.robot.name, verify(gait).verification.passed)\n"
    )
    command = [sys.executable, "-c", program, str(path)]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ran.stdout.split() == ["monopod", "True"], ran.stderr


def test_the_same_physics_may_replace_the_robot_and_others_may_not(path):
    gait = load(path)
    assert gait.with_robot(monopod()).robot is monopod()
    with pytest.raises(InputError, match=r"is not the robot 'monopod' of the gait\. It differs in: coordinates"):
        gait.with_robot(vertical_hopper())


@pytest.mark.parametrize(
    ("change", "difference"),
    [
        ({"contacts": lambda contacts: (dataclasses.replace(contacts[0], falls=True), *contacts[1:])}, "contacts"),
        ({"energy": lambda _: vertical_hopper().energy}, "energy"),
    ],
)
def test_a_robot_with_other_contacts_or_energies_is_refused(path, change, difference):
    if difference == "energy":
        other = monopod().replace_fields(energy=_heavier(monopod()))
    else:
        other = monopod().replace_fields(**{name: make(getattr(monopod(), name)) for name, make in change.items()})
    with pytest.raises(InputError, match=rf"differs in: .*{difference}"):
        load(path).with_robot(other)


def _heavier(robot):
    import casadi as ca

    q, v, p = robot.energy.sx_in()
    kinetic, potential = robot.energy(q, v, p)
    return ca.Function("energy", [q, v, p], [1.01 * kinetic, potential], ["q", "v", "p"], ["kinetic", "potential"])


@pytest.mark.parametrize(
    "name", ["motion/segments/0000/force", "motion/segments/0001/rims", "motion/events/0000/impulse", "robot", "solver"]
)
def test_a_missing_part_is_refused_in_a_sentence(path, name):
    with edit_hdf5(path) as file:
        del file[name]
    with pytest.raises(ArchiveError, match="is damaged"):
        load(path)


@pytest.mark.parametrize(
    ("group", "attribute", "value"),
    [
        ("/", "sequence", "foot hop > flight |"),
        ("/", "robot_kind", "wheels"),
        ("motion", "contacts", '[{"name": "foot"}]'),
        ("motion", "links", "[1, 2]"),
        ("motion/segments/0000", "modes", '{"foot": "hop"}'),
        ("motion/events/0000", "time", "late"),
        ("verification", "reasons", "{not json"),
    ],
)
def test_an_attribute_that_makes_no_sense_is_refused_in_a_sentence(path, group, attribute, value):
    with edit_hdf5(path) as file:
        file[group].attrs[attribute] = value
    with pytest.raises(ArchiveError, match="is damaged"):
        load(path)


def test_a_changed_robot_is_refused_before_casadi_reads_it(path):
    with edit_hdf5(path) as file:
        model = file["robot/model"][...]
        model[len(model) // 2] ^= 1
        file["robot/model"][...] = model
    gait = load(path)  # the motion is intact
    with pytest.raises(ArchiveError, match="'monopod' is damaged: its text does not have the stored SHA-256 digest"):
        verify(gait)


def test_robots_are_shared_within_a_process():
    robot = monopod()
    assert PlanarRobot.from_record(robot.record) is robot


def test_kinematics_of_contacts_agree_with_the_gap_and_the_slip(hop_gait):
    """A sticking foot has neither gap nor slip speed; its slide coordinate is its position."""
    stance, flight = hop_gait.motion.segments
    foot = hop_gait.motion.contacts.index("foot")
    np.testing.assert_allclose(stance.kinematics.gap[foot], 0, atol=1e-9)
    np.testing.assert_allclose(stance.kinematics.slip_speed[foot], 0, atol=1e-7)
    assert flight.kinematics.gap[foot].max() > 0.01
    point = hop_gait.motion.points.index("foot")
    np.testing.assert_allclose(flight.kinematics.slide[foot], flight.points[0, point], atol=1e-12)
    np.testing.assert_allclose(flight.kinematics.rims[:2, foot], flight.points[:, point], atol=1e-12)
