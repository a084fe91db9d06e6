"""A robot whose feet roll: its balances, its true contact point, and its limit of point feet."""

import numpy as np
import pytest

from gaitopt import Mode, check_robot
from gaitopt.model.contacts.impact import solve_impact

RADII = (0.0, 0.15, 0.4)


def state(robot, rng):
    """Return a state at touchdown in which the landing foot comes down."""
    angle, rates = rng.uniform(0.1, 0.5), rng.uniform(0.2, 2.0, 2)
    return np.array([rng.normal(), 0.0, angle, angle]), np.array([0.0, 0.0, rates[0], -rates[1]])


def vector(robot, **changes):
    return robot.vector(robot.resolve({"friction": 0.3, "leg_inertia": 0.05, **changes}))


@pytest.mark.parametrize("radius", RADII)
def test_it_passes_the_check_of_every_robot(rolling, radius):
    report = check_robot(rolling.robot, {"foot_radius": radius, "leg_inertia": 0.05})
    assert report.passed, report


@pytest.mark.parametrize("friction", [0.05, 0.3, 5.0])
@pytest.mark.parametrize("radius", RADII)
def test_the_impact_keeps_angular_momentum_about_the_true_contact_point(rolling, rng, radius, friction):
    robot, p = rolling.robot, vector(rolling.robot, foot_radius=radius, friction=friction)
    modes = set()
    for _ in range(20):
        q, v = state(robot, rng)
        impact = solve_impact(robot, q, v, p)
        modes.add(impact.mode)
        x, y, rim_radius, _ = np.asarray(robot.rims(q, p))[:, 1]
        place = np.array([x, y - rim_radius])
        assert place[1] == pytest.approx(0, abs=1e-15)
        about = []
        for rates in (v, impact.v_plus):
            linear, angular = (np.asarray(part).ravel() for part in robot.momentum(q, rates, p))
            about.append(angular[0] - (place[1] * linear[0] - place[0] * linear[1]))  # clockwise
        assert about[1] == pytest.approx(about[0], abs=1e-13)
        assert impact.energy_lost >= 0
    assert Mode.STICK in modes if friction == 5.0 else modes - {Mode.STICK}


def test_angular_momentum_about_the_slide_coordinate_is_not_kept(rolling, rng):
    robot, p = rolling.robot, vector(rolling.robot, foot_radius=0.4)
    q, v = state(robot, rng)
    impact = solve_impact(robot, q, v, p)
    slide = float(robot.landing(q, v, p)[0][0])
    before, after = (robot.momentum(q, rates, p) for rates in (v, impact.v_plus))
    change = [np.asarray(new - old).ravel() for old, new in zip(before, after, strict=True)]
    assert abs(change[1][0] + slide * change[0][1]) > 1e-2


def test_a_rolling_foot_does_not_move_its_material_at_the_contact(rolling, rng):
    robot, p = rolling.robot, vector(rolling.robot)
    q, v = state(robot, rng)
    step = 1e-6
    rims = [np.asarray(robot.rims(q + sign * step * v, p))[:, 0] for sign in (-1, 1)]
    centre_speed, turning = np.diff([rim[0] for rim in rims])[0] / (2 * step), np.diff([rim[3] for rim in rims])[0]
    assert centre_speed == pytest.approx(rims[0][2] * turning / (2 * step), rel=1e-8)
    v[0] = 0.7  # now it slides
    rims = [np.asarray(robot.rims(q + sign * step * v, p))[:, 0] for sign in (-1, 1)]
    centre_speed, turning = np.diff([rim[0] for rim in rims])[0] / (2 * step), np.diff([rim[3] for rim in rims])[0]
    assert centre_speed - rims[0][2] * turning / (2 * step) == pytest.approx(0.7, rel=1e-8)


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_without_a_radius_it_is_the_compass_biped(rolling, compass, rng, mode):
    values = {"leg_length": 1.6, "leg_com": 0.8, "leg_mass": 4.0, "hip_mass": 2.0, "gravity": 9.8, "friction": 0.2}
    p = rolling.robot.vector(rolling.robot.resolve({**values, "foot_radius": 0.0}))
    for _ in range(5):
        q, v, u = rng.normal(size=4), rng.normal(size=4), rng.normal(size=2)
        round_one = rolling.robot.acceleration[mode](q, v, u, p)
        pointed = compass.acceleration[mode](q, v, u, compass.vector(compass.resolve(values)))
        for one, other in zip(round_one, pointed, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)


def test_the_landing_foot_becomes_the_stance_foot_without_moving(rolling, rng):
    robot, p = rolling.robot, vector(rolling.robot)
    q, v = state(robot, rng)
    before = np.asarray(robot.rims(q, p))
    after = np.asarray(robot.rims(robot.swap(q, v, p)[0], p))
    np.testing.assert_allclose(after, before[:, ::-1], atol=1e-14)
