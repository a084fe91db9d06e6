"""Torque and gain tables as JSON."""

import json

import numpy as np
import pytest

from gaitopt import InputError, feedforward, joint_pd, simulate, write_torques


def test_interpolated_torques_are_those_of_the_law(tmp_path, slip_gait, compass):
    table = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json").read_text(encoding="utf-8"))
    law, n = feedforward(compass, slip_gait.motion), compass.n_q
    for clock in np.linspace(0.001, slip_gait.period - 0.001, 57):
        expected = np.asarray(law.torque(clock, np.zeros(n), np.zeros(n), law.table[:, law.piece(clock)])).ravel()
        ours = [np.interp(clock, table["time"], table["torque"][name]) for name in compass.actuators]
        assert ours == pytest.approx(expected, abs=1e-9)
    assert table["word"] == "slip+ stick | slip+"
    assert (table["law"], table["gains"]) == (None, {})
    assert {len(column) for column in table["torque"].values()} == {len(table["time"]), len(table["mode"])}


def test_gains_of_a_law(tmp_path, slip_gait, compass):
    law = joint_pd(compass, slip_gait.motion, stiffness=20, damping=5)
    table = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json", law=law).read_text(encoding="utf-8"))
    assert table["law"] == "pd"
    assert table["gains"] == {
        "ankle_stiffness": 20.0,
        "hip_stiffness": 20.0,
        "ankle_damping": 5.0,
        "hip_damping": 5.0,
    }


def test_a_robot_without_actuators_has_no_torques(tmp_path, wheel):
    walk = simulate(wheel, [0, 0, -0.314], [0, 0, 0.9], {"slope": 0.2})
    with pytest.raises(InputError, match="no torques"):
        write_torques(walk.motion, tmp_path / "t.json")
