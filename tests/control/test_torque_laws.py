"""Control laws: the torques they give between, at and after their samples."""

import dataclasses

import numpy as np
import pytest

from gaitopt import InputError, Mode, Motion, feedforward, passive
from gaitopt.control.reference import reference
from gaitopt.motion import Segment


def segment(time, torque, *, step=0):
    count = time.size
    zero = np.zeros(count)
    return Segment(
        mode=Mode.STICK,
        step=step,
        time=time,
        q=np.zeros((4, count)),
        v=np.zeros((4, count)),
        torque=torque,
        force=np.zeros((2, count)),
        power=np.zeros((2, count)),
        work=np.zeros((2, count)),
        friction_work=zero,
        kinetic=zero,
        potential=zero,
        points=np.zeros((2, 3, count)),
    )


def motion(*segments):
    return Motion(
        angles=("th1", "th2"),
        actuators=("ankle", "hip"),
        points=(),
        links=(),
        total_mass=1.0,
        parameters={},
        segments=segments,
        jumps=(),
    )


def torque(law, clock, q=(0, 0, 0.1, 0.2), v=(0, 0, 1.0, 2.0)):
    return law.torque_at(clock, q, v)


@pytest.fixture
def samples():
    time = np.array([0.0, 0.1, 0.15, 0.4])
    return time, np.array([[1.0, -2.0, 0.5, 0.25], [0.0, 4.0, 4.0, -1.0]])


def test_torques_are_linear_between_samples(compass, samples):
    time, torques = samples
    law = feedforward(compass, motion(segment(time, torques)))
    for clock in np.linspace(0, 0.4, 83):
        expected = [np.interp(clock, time, row) for row in torques]
        np.testing.assert_allclose(torque(law, clock), expected, rtol=1e-13, atol=1e-13)


def test_the_last_torque_is_held(compass, samples):
    law = feedforward(compass, motion(segment(*samples)))
    for clock in (0.4, 0.41, 7.0):
        np.testing.assert_allclose(torque(law, clock), [0.25, -1.0], rtol=1e-14)


def test_the_clock_starts_with_the_motion_and_the_state_does_not_matter(compass, samples):
    time, torques = samples
    law = feedforward(compass, motion(segment(time + 3.0, torques)))
    np.testing.assert_allclose(torque(law, 0.05), [-0.5, 2.0], rtol=1e-12)
    np.testing.assert_array_equal(torque(law, 0.05), torque(law, 0.05, q=(9, 9, 9, 9), v=(9, 0, 9, 9)))


def test_only_the_first_step_is_played(compass, samples):
    time, torques = samples
    law = feedforward(compass, motion(segment(time, torques), segment(time + 0.4, 100 * torques, step=1)))
    np.testing.assert_allclose(torque(law, 0.5), [0.25, -1.0], rtol=1e-14)


def test_phases_that_share_a_sample_are_joined(compass, samples):
    time, torques = samples
    law = feedforward(compass, motion(segment(time[:3], torques[:, :3]), segment(time[2:], torques[:, 2:])))
    assert law.breakpoints.size == 4
    for clock in np.linspace(0, 0.4, 83):
        expected = [np.interp(clock, time, row) for row in torques]
        np.testing.assert_allclose(torque(law, clock), expected, rtol=1e-13, atol=1e-13)


def test_samples_on_a_straight_line_are_no_corners(compass, slip_gait):
    law = feedforward(compass, slip_gait.motion)
    counts = slip_gait.problem["intervals"]
    assert law.breakpoints.size == sum(counts) + 1  # the motion has a sample in the middle of each interval, too
    for one in slip_gait.motion.segments:
        for clock, expected in zip(one.time, one.torque.T, strict=True):
            np.testing.assert_allclose(torque(law, clock), expected, atol=1e-12)


def test_a_torque_may_jump_between_phases(compass):
    one = segment(np.array([0.0, 0.2]), np.array([[0.0, 1.0], [0.0, 0.0]]))
    two = segment(np.array([0.2, 0.4]), np.array([[5.0, 7.0], [1.0, 1.0]]))
    law = feedforward(compass, motion(one, two))
    clocks = {0.1: [0.5, 0.0], 0.2 - 1e-9: [1.0, 0.0], 0.2: [5.0, 1.0], 0.3: [6.0, 1.0], 0.5: [7.0, 1.0]}
    for clock, expected in clocks.items():
        np.testing.assert_allclose(torque(law, clock), expected, atol=1e-7)


def test_a_robot_without_actuators_can_be_played_back(wheel):
    none = dataclasses.replace(motion(segment(np.array([0.0, 1.0]), np.zeros((0, 2)))), actuators=(), angles=("theta",))
    law = feedforward(wheel, none)
    assert torque(law, 0.5, q=(0, 0, 0), v=(0, 0, 1)).shape == (0,)


def test_a_motion_of_other_actuators_is_refused(wheel, slip_gait):
    with pytest.raises(InputError, match=r"actuators \('ankle', 'hip'\) and .* but the robot has \(\) and"):
        feedforward(wheel, slip_gait.motion)


def test_a_motion_whose_angles_stand_in_another_order_is_refused(compass, slip_gait):
    turned = dataclasses.replace(slip_gait.motion, angles=("th2", "th1"))
    for law in (feedforward, reference):
        with pytest.raises(InputError, match=r"angles \('th2', 'th1'\), but the robot has .* \('th1', 'th2'\)"):
            law(compass, turned)


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_passive_is_zero_always(request, name):
    robot = request.getfixturevalue(name)
    law = passive(robot)
    for clock in (0.0, 1.0, 1e6):
        result = torque(law, clock, q=np.ones(robot.n_q), v=np.ones(robot.n_q))
        assert result.shape == (robot.n_u,)
        np.testing.assert_array_equal(result, 0.0)


def test_pieces_begin_at_their_breakpoint(compass, samples):
    law = feedforward(compass, motion(segment(*samples)))
    assert [law.piece(clock) for clock in (-1.0, 0.0, 0.05, 0.1, 0.15, 0.39, 0.4, 9.0)] == [0, 0, 0, 1, 2, 2, 3, 3]


def test_laws_that_compute_alike_share_a_function(compass, samples):
    time, torques = samples
    one, two = (feedforward(compass, motion(segment(scale * time, torques))) for scale in (1, 2))
    assert one.torque is two.torque
    assert one.torque is not passive(compass).torque
    assert one.breakpoints[1] != two.breakpoints[1]
