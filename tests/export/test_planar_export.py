"""CSV and torque tables of robots with several contacts."""

import csv
import json

import numpy as np
import pytest

from gaitopt import InputError, feedforward, load, write_csv, write_torques
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.simulation import place_planar, simulate_planar
from tests.conftest import ROOT


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


@pytest.fixture(scope="module")
def table(hop_gait, tmp_path_factory):
    return read(write_csv(hop_gait.motion, tmp_path_factory.mktemp("csv") / "hop.csv"))


@pytest.mark.parametrize(
    ("name", "channel", "row"),
    [
        ("x_m", "q", 0),
        ("phi_rad", "q", 2),
        ("s_m", "q", 4),
        ("a_rate_rad_per_s", "v", 3),
        ("leg_force_N", "torque", 0),
        ("hip_torque_Nm", "torque", 1),
        ("leg_work_J", "work", 0),
        ("foot_normal_force_N", "force", (0, 1)),
        ("foot_tangential_force_N", "force", (0, 0)),
        ("elastic_J", "elastic", ()),
    ],
)
def test_numbers_come_back_bit_by_bit(table, hop_gait, name, channel, row):
    assert np.array_equal(np.array(table[name], dtype=float), hop_gait.motion.channel(channel)[row])


def test_a_robot_adds_the_powers_of_its_actuators(hop_gait, table, tmp_path):
    """The leg force works on the rate of the leg's length, the hip torque on that of the angle to the body."""
    powers = read(write_csv(hop_gait.motion, tmp_path / "hop.csv", robot=hop_gait.robot))
    assert [name for name in powers if name not in table] == ["leg_power_W", "hip_power_W"]
    columns = {name: np.array(powers[name], dtype=float) for name in powers if not name.endswith("mode")}
    assert np.array_equal(columns["leg_power_W"], columns["leg_force_N"] * columns["s_rate_m_per_s"])
    for name in ("leg", "hip"):
        start = 0
        for part in hop_gait.motion.segments:
            rows = slice(start, start := start + part.time.size)
            power, work = columns[f"{name}_power_W"][rows], columns[f"{name}_work_J"][rows]
            steps = np.diff(part.time) * (power[1:] + power[:-1]) / 2
            np.testing.assert_allclose(np.cumsum(steps), work[1:], atol=0.02 * np.ptp(work))


def test_each_contact_has_its_mode_its_gap_and_its_slip_speed(table, hop_gait):
    assert set(table["foot_mode"]) == {"stick", "free"}
    gap = np.concatenate([part.kinematics.gap[0] for part in hop_gait.motion.segments])
    speed = np.concatenate([part.kinematics.slip_speed[0] for part in hop_gait.motion.segments])
    assert np.array_equal(np.array(table["foot_gap_m"], dtype=float), gap)
    assert np.array_equal(np.array(table["foot_slip_speed_m_per_s"], dtype=float), speed)
    assert all(name.isidentifier() for name in table)
    assert not [name for name in table if name.startswith("hip_point") and "mode" in name]  # it never closes


def test_a_joint_stop_has_a_torque_and_a_gap(tmp_path):
    robot, values = kneed_walker(), {"slope": 0.05}
    coordinates = {"x": 0, "a": 0.2386, "flexion_a": 0, "b": -0.2386, "flexion_b": 0}
    rates = {"a": -1.1096, "flexion_a": 0, "b": -0.0571, "flexion_b": 0}
    q, v = place_planar(robot, coordinates, rates, values, on=("foot A",))
    motion = simulate_planar(robot, q, v, values, until="foot B closes").motion
    table = read(write_csv(motion, tmp_path / "walk.csv"))
    assert set(table["knee_A_mode"]) == {"latched"}
    assert np.max(np.abs(np.array(table["knee_A_stop_torque_Nm"], dtype=float))) > 0.01
    np.testing.assert_allclose(np.array(table["knee_B_gap_rad"], dtype=float), motion.channel("q")[-1], atol=1e-12)


def test_torques_and_forces_have_their_units(hop_gait, tmp_path):
    data = json.loads(write_torques(hop_gait.motion, tmp_path / "hop.json").read_text(encoding="utf-8"))
    assert data["torque_unit"] == {"leg": "N", "hip": "N m"}
    assert data["sequence"] == "foot stick > flight |"
    assert (data["angle_unit"], data["length_unit"]) == ("rad", "m")
    assert list(data["angle"]) == ["phi", "a"]
    assert list(data["length"]) == ["y", "s"]
    assert set(data["mode"]["foot"]) == {"stick", "free"}
    assert np.array_equal(data["torque"]["leg"], hop_gait.motion.channel("torque")[0])


def test_gains_are_those_of_walkers(hop_gait, tmp_path):
    walk = load(ROOT / "docs" / "examples" / "compass_slip.h5")
    with pytest.raises(InputError, match="leave out the law, or export a controller"):
        write_torques(hop_gait.motion, tmp_path / "hop.json", law=feedforward(walk.robot, walk.motion))
