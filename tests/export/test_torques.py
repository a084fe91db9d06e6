"""Torque and gain tables as JSON."""

import json

import numpy as np
import pytest

from gaitopt import (
    InputError,
    by_stance_angle,
    feedforward,
    joint_pd,
    lqr,
    simulate,
    step_lqr,
    write_torques,
)


def test_interpolated_torques_are_those_of_the_law(tmp_path, slip_gait, compass):
    table = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json").read_text(encoding="utf-8"))
    law, n = feedforward(compass, slip_gait.motion), compass.n_q
    for clock in np.linspace(0.001, slip_gait.period - 0.001, 57):
        expected = law.torque_at(clock, np.zeros(n), np.zeros(n))
        ours = [np.interp(clock, table["time"], table["torque"][name]) for name in compass.actuators]
        assert ours == pytest.approx(expected, abs=1e-9)
    assert table["sequence"] == "slip+ stick | slip+"
    assert (table["law"], table["gains"]) == (None, {})
    assert {len(column) for column in table["torque"].values()} == {len(table["time"]), len(table["mode"])}


def test_gains_of_a_law(tmp_path, slip_gait, compass):
    law = joint_pd(compass, slip_gait.motion, stiffness=20, damping=5)
    table = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json", law=law).read_text(encoding="utf-8"))
    assert table["law"] == "joint_pd"
    assert table["gains"] == {
        "ankle_stiffness": 20.0,
        "hip_stiffness": 20.0,
        "ankle_damping": 5.0,
        "hip_damping": 5.0,
    }
    ankle = table["torque_by_state"]["ankle"]
    assert set(ankle["th1"]) == {-20.0}
    assert set(ankle["th1_rate"]) == {-5.0}
    assert set(table["torque_by_state"]["hip"]["th1"]) == {-20.0}  # it works on th1 + th2
    assert set(ankle["th2"]) == set(ankle["foot_speed"]) == {0.0}


def test_gains_over_time_are_differences_of_the_torque(tmp_path, slip_gait, compass):
    laws = (lqr(compass, slip_gait.motion), step_lqr(compass, slip_gait.motion, torque_limit=9))
    laws += (by_stance_angle(compass, slip_gait.motion, laws[0]),)
    segment, step = slip_gait.motion.segments[1], 1e-6
    for law in laws:
        path = write_torques(slip_gait.motion, tmp_path / "t.json", law=law)
        table = json.loads(path.read_text(encoding="utf-8"))["torque_by_state"]
        first = slip_gait.motion.segments[0]
        latched = law.memory.latch(first.q[:, 0], first.v[:, 0], law.table[:, 0])
        for k in (5, 40):
            clock, q, v = segment.time[k] - first.time[0], segment.q[:, k], segment.v[:, k]
            data = law.table[:, law.piece(law.measure(clock, np.concatenate((q, v))) - 1e-9)]
            plus, minus = (law.control(clock, q, np.add(v, (0, 0, d, 0)), latched, 0, data)[0] for d in (step, -step))
            expected = np.asarray(plus - minus).ravel() / (2 * step)
            ours = [table[name]["th1_rate"][first.time.size + k] for name in compass.actuators]
            assert ours == pytest.approx(expected, abs=1e-5)


def test_gain_matrices_are_those_of_the_law(tmp_path, slip_gait, compass):
    """The torques of the table and K (x - x_ref), put together outside, are those of the law."""
    law, segment = lqr(compass, slip_gait.motion), slip_gait.motion.segments[1]
    facts = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json", law=law).read_text(encoding="utf-8"))
    (matrix,) = facts["gain_matrices"]
    assert matrix["rows"] == ["ankle", "hip"]
    assert matrix["columns"] == ["th1", "th2", "foot_speed", "th1_rate", "th2_rate"]
    begins, value, slope = np.array(facts["pieces"]["begin"]), np.array(matrix["value"]), np.array(matrix["slope"])
    error = np.array([0.01, -0.02, 0.0, 0.03, 0.05])
    for k in (4, 33):
        clock = segment.time[k]
        piece = np.searchsorted(begins, clock, side="right") - 1
        gain = value[piece] + slope[piece] * (clock - begins[piece])
        q, v = segment.q[:, k] + [0, 0, *error[:2]], segment.v[:, k] + [error[2], 0, *error[3:]]
        assert law.torque_at(clock, q, v) == pytest.approx(segment.torque[:, k] - gain @ error, abs=1e-8)
    law = step_lqr(compass, slip_gait.motion)
    facts = json.loads(write_torques(slip_gait.motion, tmp_path / "t.json", law=law).read_text(encoding="utf-8"))
    (matrix,) = facts["gain_matrices"]
    assert matrix["columns"] == ["th1", "th1_rate", "th2_rate", "foot_speed"]
    assert matrix["rows"] == list(law.memory.values) == ["ankle_0", "hip_0", "ankle_1", "hip_1"]
    first, push = slip_gait.motion.segments[0], np.array([0, 0, 0, 0.02])
    latched = [
        np.asarray(law.memory.latch(first.q[:, 0], first.v[:, 0] + k * push, law.table[:, 0])).ravel() for k in (0, 1)
    ]
    assert latched[1] - latched[0] == pytest.approx(-0.02 * np.array(matrix["value"][0])[:, 2], abs=1e-12)


def test_a_robot_without_actuators_has_no_torques(tmp_path, wheel):
    walk = simulate(wheel, [0, 0, -0.314], [0, 0, 0.9], {"slope": 0.2})
    with pytest.raises(InputError, match="no torques"):
        write_torques(walk.motion, tmp_path / "t.json")
