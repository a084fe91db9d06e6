"""Touchdown guards: zero with the landing foot on the ground, their rates by finite differences."""

import numpy as np
import pytest


def numbers(robot, q, v):
    p = robot.vector(robot.resolve({}))
    return [float(part) for part in robot.touchdown(q, v, p)]


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_rate_is_the_derivative_of_the_guard_along_the_motion(request, rng, name):
    robot = request.getfixturevalue(name)
    for _ in range(20):
        q, v, step = rng.uniform(-0.5, 0.5, robot.n_q), rng.normal(size=robot.n_q), 1e-5
        difference = (numbers(robot, q + step * v, v)[0] - numbers(robot, q - step * v, v)[0]) / (2 * step)
        assert numbers(robot, q, v)[1] == pytest.approx(difference, rel=1e-8, abs=1e-8)


def test_compass_guard_vanishes_with_both_feet_on_the_ground_and_falls_while_the_foot_does(compass):
    p = compass.vector(compass.resolve({}))
    for th in (0.05, 0.3):
        for rates in ([0.7, -0.4], [0.2, 0.9], [-0.3, -0.9]):
            q, v = [0, 0, th, th], [0, 0, *rates]
            guard, rate, armed = numbers(compass, q, v)
            position, velocity, _ = (np.asarray(part).ravel() for part in compass.landing(q, v, p))
            assert guard == 0
            assert armed > 0
            assert position[1] == pytest.approx(0.0, abs=1e-15)
            assert np.sign(rate) == np.sign(velocity[1])


def test_compass_guard_does_not_count_at_the_start_of_a_step(compass):
    assert numbers(compass, [0, 0, -0.15, -0.15], [0, 0, 0.7, -0.5])[2] < 0
