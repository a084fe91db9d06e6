"""Segments and jumps filled in from states: everything that follows, against the robot's own mechanics by hand."""

import numpy as np
import pytest

from gaitopt import Mode
from gaitopt.motion.sampling import SegmentSamples, TouchdownState, make_jump, make_motion, make_segment
from tests.newton_euler.compass import HandCompass


@pytest.fixture
def hand():
    return HandCompass(slope=0.03, mu=0.2)


def test_a_segment_has_the_forces_powers_and_energies_of_its_states(compass, hand, rng):
    p, count = compass.vector(compass.resolve(hand.parameters)), 5
    q = np.vstack([rng.normal(size=(1, count)), np.zeros((1, count)), rng.uniform(-0.4, 0.4, size=(2, count))])
    v = np.vstack([np.zeros((2, count)), rng.normal(size=(2, count))])
    torque = rng.normal(size=(2, count))
    made = make_segment(
        compass,
        p,
        SegmentSamples(
            mode=Mode.STICK,
            step=2,
            time=np.arange(5.0),
            q=q,
            v=v,
            torque=torque,
            work=np.zeros((2, count)),
            friction_work=np.zeros(count),
        ),
    )
    assert made.points.shape == (2, 3, count)
    for k in range(count):
        _, force = hand.stick(q[2:, k], v[2:, k], torque[:, k])
        np.testing.assert_allclose(made.force[:, k], force, rtol=1e-11)
        np.testing.assert_allclose(made.power[:, k], torque[:, k] * [v[2, k], v[2, k] + v[3, k]], rtol=1e-13)
        bodies = hand.bodies(q[2:, k], v[:2, k], v[2:, k])
        assert made.kinetic[k] == pytest.approx(sum(m * w @ w / 2 for m, _, w in bodies), rel=1e-12)
        np.testing.assert_allclose(made.points[:, 1, k], q[:2, k] + bodies[1][1], rtol=1e-12, atol=1e-14)


def test_a_robot_without_actuators_gets_empty_torques(wheel):
    p = wheel.vector(wheel.resolve({}))
    empty = np.zeros((0, 2))
    made = make_segment(
        wheel,
        p,
        SegmentSamples(
            mode=Mode.STICK,
            step=0,
            time=np.arange(2.0),
            q=np.zeros((3, 2)),
            v=np.zeros((3, 2)),
            torque=empty,
            work=empty,
            friction_work=np.zeros(2),
        ),
    )
    assert made.power.shape == (0, 2)
    np.testing.assert_allclose(made.force, [[0, 0], [9.8, 9.8]], atol=1e-14)


def test_a_jump_loses_the_kinetic_energy_and_swaps_the_legs(compass, hand):
    p = compass.vector(compass.resolve(hand.parameters))
    th, v = np.array([0.15, 0.15]), np.array([0, 0, 0.7, -0.4])
    after, impulse = hand.impact(th, v, 0)
    made = make_jump(
        compass,
        p,
        TouchdownState(
            step=0,
            time=0.7,
            mode=Mode.STICK,
            impulse=impulse,
            q=np.array([0.3, 0, *th]),
            v_minus=v,
            v_plus=after,
        ),
    )
    before, left = (sum(m * w @ w / 2 for m, _, w in hand.bodies(th, rate[:2], rate[2:])) for rate in (v, after))
    assert made.energy_lost == pytest.approx(before - left, rel=1e-10)
    assert made.separation == after[1]
    np.testing.assert_allclose(made.q_next, [0.3 + 2 * 1.6 * np.sin(0.15), 0, -0.15, -0.15], atol=1e-14)
    np.testing.assert_allclose(made.v_next, [0, 0, -after[3], -after[2]], atol=1e-12)


def test_a_motion_weighs_what_its_robot_weighs(compass, hand):
    motion = make_motion(compass, compass.resolve(hand.parameters), (), ())
    assert motion.total_mass == pytest.approx(10.0)
    assert motion.parameters["friction"] == 0.2
