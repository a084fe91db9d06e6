"""Computed torque against the accelerations it is to produce, sticking and sliding."""

import dataclasses

import numpy as np
import pytest

from gaitopt import InputError, computed_torque, joint_pd, load, rimless_wheel
from gaitopt.control.inverse_dynamics import prescribed_angles


@pytest.fixture(scope="module")
def motion():
    return load("docs/examples/compass_slip.h5").motion


def torque(law, clock, q, v, latched=(), slide=0):
    return law.torque_at(clock, q, v, latched=latched, slide=slide)


@pytest.mark.parametrize(("part", "k"), [(0, 0), (0, 7), (1, 5), (1, 33), (1, -1)])
def test_on_the_plan_it_asks_for_the_planned_torque(compass, motion, part, k):
    segment, law = motion.segments[part], computed_torque(compass, motion, stiffness=25, damping=10)
    found = torque(law, segment.time[k], segment.q[:, k], segment.v[:, k])
    assert found == pytest.approx(segment.torque[:, k], abs=1e-9)


@pytest.mark.parametrize("part", [0, 1])
def test_errors_of_angles_obey_the_equation_asked_for(compass, motion, part):
    # Away from the plan the robot's own accelerations under the law must be the asked ones, whatever the foot does.
    segment, p = motion.segments[part], compass.vector(motion.parameters)
    law = computed_torque(compass, motion, stiffness=25, damping=10)
    k, off_q, off_v = 9, np.array([0, 0, 0.02, -0.03]), np.array([0, 0, -0.1, 0.2])
    clock, q, v = segment.time[k], segment.q[:, k] + off_q, segment.v[:, k] + off_v
    found, _ = compass.acceleration[segment.mode](q, v, torque(law, clock, q, v), p)
    planned, _ = compass.acceleration[segment.mode](segment.q[:, k], segment.v[:, k], segment.torque[:, k], p)
    expected = np.asarray(planned).ravel()[2:] - 25 * off_q[2:] - 10 * off_v[2:]
    # A sliding foot is taken to slide fully only well above 0.01 m/s; here it has 0.07 m/s.
    assert np.asarray(found).ravel()[2:] == pytest.approx(expected, abs=1e-8 if part else 0.05)


@pytest.mark.parametrize("part", [0, 1])
def test_prescribed_angles_are_reproduced_whatever_the_foot_does(compass, motion, part):
    segment, p = motion.segments[part], compass.vector(motion.parameters)
    law, k = prescribed_angles(compass, motion, motion.parameters), 9
    clock, q, v = segment.time[k], segment.q[:, k], segment.v[:, k]
    asked = torque(law, clock, q, v, [], segment.mode.sign)
    assert asked == pytest.approx(segment.torque[:, k], abs=1e-9)
    other = [mode for mode in compass.acceleration if mode.value in ("stick", "slip+", "slip-")]
    planned = np.asarray(compass.acceleration[segment.mode](q, v, segment.torque[:, k], p)[0]).ravel()[2:]
    for mode in other:
        found, _ = compass.acceleration[mode](q, v, torque(law, clock, q, v, [], mode.sign), p)
        assert np.asarray(found).ravel()[2:] == pytest.approx(planned, abs=1e-8)


def test_it_needs_an_actuator_for_each_angle(motion):
    wheel = rimless_wheel()
    with pytest.raises(InputError, match="actuators"):
        computed_torque(wheel, motion)
    with pytest.raises(InputError, match="actuators"):
        joint_pd(wheel, dataclasses.replace(motion, actuators=("ankle",)))
