"""The compass's Functions against Newton's and Euler's laws written by hand."""

import numpy as np
import pytest

from gaitopt import Mode


def flat(output):
    return np.asarray(output).ravel()


def test_mass_matrix_is_the_closed_form(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, _ in states:
        th1, th2 = q[2:]
        mass = np.asarray(compass.dynamics(q, v, p)[0])
        stance, swing = (
            hand.mass * hand.com + (hand.mass + hand.hip) * hand.length,
            hand.mass * (hand.length - hand.com),
        )
        foot_rows = [[stance * np.cos(th1), swing * np.cos(th2)], [-stance * np.sin(th1), swing * np.sin(th2)]]
        np.testing.assert_allclose(mass[2:, 2:], hand.leg_matrix(th1, th2), rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(mass[:2, 2:], foot_rows, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(mass[:2, :2], hand.total * np.eye(2), rtol=1e-13)
        np.testing.assert_allclose(mass, mass.T, rtol=1e-15, atol=1e-15)


def test_a_stuck_foot(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, u in states:
        v = np.array([0.0, 0.0, *v[2:]])
        acceleration, force = map(flat, compass.acceleration[Mode.STICK](q, v, u, p))
        expected, expected_force = hand.stick(q[2:], v[2:], u)
        np.testing.assert_allclose(acceleration, [0, 0, *expected], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(force, expected_force, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("mode", [Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_a_sliding_foot(compass, hand, states, mode):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, u in states:
        v = np.array([mode.sign * abs(v[0]), *v[1:]])
        acceleration, force = map(flat, compass.acceleration[mode](q, v, u, p))
        slide, turn, expected_force = hand.slip(mode.sign, q[2:], v[2:], u)
        scale = np.max(np.abs([slide, *turn, *expected_force]))
        np.testing.assert_allclose(acceleration, [slide, 0, *turn], rtol=1e-9, atol=1e-12 * scale)
        np.testing.assert_allclose(force, expected_force, rtol=1e-9, atol=1e-12 * scale)


def test_a_free_foot_lets_the_centre_of_mass_fall(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, u in states:
        acceleration, force = map(flat, compass.acceleration[Mode.FREE](q, v, u, p))
        foot, (a1, a2) = acceleration[:2], acceleration[2:]
        # hand.foot_force is m (acceleration of the centre of mass - gravity) for a foot without vertical acceleration
        support = hand.foot_force(q[2:], v[2:], (a1, a2), xdd=foot[0])
        support[1] += hand.total * foot[1]
        np.testing.assert_allclose(support, 0.0, atol=1e-10 * hand.total * hand.gravity + 1e-9 * np.abs(a2))
        np.testing.assert_array_equal(force, 0.0)


def test_energies_are_those_of_the_three_masses(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, _ in states:
        bodies = hand.bodies(q[2:], v[:2], v[2:])
        kinetic = sum(mass * velocity @ velocity / 2 for mass, _, velocity in bodies)
        height = [q[1] + position[1] for _, position, _ in bodies]
        along = [q[0] + position[0] for _, position, _ in bodies]
        potential = hand.gravity * sum(
            mass * (h * np.cos(hand.slope) - x * np.sin(hand.slope))
            for (mass, _, _), h, x in zip(bodies, height, along, strict=True)
        )
        np.testing.assert_allclose([float(part) for part in compass.energy(q, v, p)], [kinetic, potential], rtol=1e-11)


def test_momentum_is_that_of_the_three_masses(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, _ in states:
        bodies = hand.bodies(q[2:], v[:2], v[2:])
        linear, angular = map(flat, compass.momentum(q, v, p))
        about_origin = sum(
            mass * ((q[1] + r[1]) * velocity[0] - (q[0] + r[0]) * velocity[1]) for mass, r, velocity in bodies
        )
        np.testing.assert_allclose(linear, sum(mass * velocity for mass, _, velocity in bodies), rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(angular, about_origin, rtol=1e-10, atol=1e-11)
        assert float(compass.mass(p)) == pytest.approx(hand.total, rel=1e-15)


def test_torques_work_on_the_ankle_and_on_the_angle_between_the_legs(compass, states):
    p = compass.vector(compass.resolve({}))
    for q, v, _ in states:
        np.testing.assert_allclose(flat(compass.joint_rates(q, v, p)), [v[2], v[2] + v[3]], rtol=1e-15)
        # Section 1 of the study's model: generalized forces on (th1, th2) are (tau_a + tau_h, tau_h).
        np.testing.assert_array_equal(np.asarray(compass.dynamics(q, v, p)[2]), [[0, 0], [0, 0], [1, 1], [0, 1]])


def test_points_are_joined_by_legs_of_the_right_length(compass, hand, states):
    p = compass.vector(compass.resolve(hand.parameters))
    for q, v, _ in states:
        points = np.asarray(compass.figure(q, p))
        np.testing.assert_allclose(points[:, 0], q[:2], rtol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=1), axis=0), hand.length, rtol=1e-14)
        position, velocity = hand.landing(q[2:], v[:2], v[2:])
        np.testing.assert_allclose(points[:, 2], q[:2] + position, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(flat(compass.landing(q, v, p)[1]), velocity, rtol=1e-12, atol=1e-13)
