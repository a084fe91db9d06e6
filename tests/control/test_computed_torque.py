"""Computed torque against the accelerations it is to produce, sticking and sliding."""

import dataclasses

import numpy as np
import pytest

from gaitopt import InputError, Mode, computed_torque, joint_pd, load, rimless_wheel


@pytest.fixture(scope="module")
def motion():
    return load("docs/examples/compass_slip.h5").motion


def torque(law, clock, q, v, slide):
    return np.asarray(law.torque(clock, q, v, law.table[:, law.piece(clock)], [], slide)).ravel()


@pytest.mark.parametrize(("part", "k"), [(0, 0), (0, 7), (1, 5), (1, 33), (1, -1)])
def test_on_the_plan_it_asks_for_the_planned_torque(compass, motion, part, k):
    segment, law = motion.segments[part], computed_torque(compass, motion, stiffness=25, damping=10)
    found = torque(law, segment.time[k], segment.q[:, k], segment.v[:, k], segment.mode.sign)
    assert found == pytest.approx(segment.torque[:, k], abs=1e-9)


@pytest.mark.parametrize("part", [0, 1])
def test_errors_of_angles_obey_the_equation_asked_for(compass, motion, part):
    # Away from the plan the robot's own accelerations under the law must be the asked ones, whatever the foot does.
    segment, p = motion.segments[part], compass.vector(motion.parameters)
    law = computed_torque(compass, motion, stiffness=25, damping=10)
    k, off_q, off_v = 9, np.array([0, 0, 0.02, -0.03]), np.array([0, 0, -0.1, 0.2])
    clock, q, v = segment.time[k], segment.q[:, k] + off_q, segment.v[:, k] + off_v
    slide = segment.mode.sign
    found, _ = compass.acceleration[segment.mode](q, v, torque(law, clock, q, v, slide), p)
    planned, _ = compass.acceleration[segment.mode](segment.q[:, k], segment.v[:, k], segment.torque[:, k], p)
    expected = np.asarray(planned).ravel()[2:] - 25 * off_q[2:] - 10 * off_v[2:]
    assert np.asarray(found).ravel()[2:] == pytest.approx(expected, abs=1e-8)


def test_a_late_end_of_the_slide_still_asks_for_sliding_accelerations(compass, motion):
    # Just after the planned end of the slide, a foot that still slides is asked for what was planned at that end.
    slide, p = motion.segments[0], compass.vector(motion.parameters)
    law = computed_torque(compass, motion)
    clock, q, v = slide.time[-1] + 1e-6, slide.q[:, -1], slide.v[:, -1]
    late, _ = compass.acceleration[Mode.SLIP_FORWARD](q, v, torque(law, clock, q, v, 1), p)
    planned, _ = compass.acceleration[Mode.SLIP_FORWARD](q, v, slide.torque[:, -1], p)
    assert np.asarray(late).ravel()[2:] == pytest.approx(np.asarray(planned).ravel()[2:], abs=1e-9)


def test_it_needs_an_actuator_for_each_angle(motion):
    wheel = rimless_wheel()
    with pytest.raises(InputError, match="an actuator for each angle"):
        computed_torque(wheel, motion)
    with pytest.raises(InputError, match="actuators"):
        joint_pd(wheel, dataclasses.replace(motion, actuators=("ankle",)))
