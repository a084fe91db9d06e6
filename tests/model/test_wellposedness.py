"""Painleve's paradox: what resists a sliding foot, against the rod on a rough floor, by hand."""

import dataclasses

import numpy as np
import pytest

from gaitopt import Mode
from tests.newton_euler.wheel import HandWheel


def indicator(robot, hand, q):
    p = robot.vector(robot.resolve(hand.parameters))
    return np.asarray(robot.wellposed(q, p)).ravel()


@pytest.mark.parametrize("mu", [0.0, 0.4, 3.0])
def test_indicator_is_the_mass_that_resists_a_push_of_a_sliding_foot(wheel, rng, mu):
    hand = HandWheel(kappa=0.1, mu=mu)
    for theta in rng.uniform(-hand.half, hand.half, 20):
        expected = [hand.push(theta, sign) for sign in (1, -1)]
        np.testing.assert_allclose(indicator(wheel, hand, [0, 0, theta]), expected, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(("theta", "sign"), [(-0.4, 1), (0.4, -1)])
def test_paradox_begins_at_the_friction_of_painleve(wheel, theta, sign):
    """A rod that leans away from its direction of slip jams beyond mu = (kappa + sin^2) / (sin cos)."""
    critical = (0.1 + np.sin(theta) ** 2) / abs(np.sin(theta) * np.cos(theta))
    which = 0 if sign > 0 else 1
    below, above = (HandWheel(spokes=7, kappa=0.1, mu=critical * factor) for factor in (0.999, 1.001))
    assert indicator(wheel, below, [0, 0, theta])[which] > 0
    assert indicator(wheel, above, [0, 0, theta])[which] < 0
    assert indicator(wheel, above, [0, 0, theta])[1 - which] > 0


def test_slip_that_is_not_well_posed_pushes_a_foot_down_when_it_is_pulled_up(compass, hand, states):
    """Where the indicator is positive, and only there, a larger normal force lifts the foot."""
    rough = dataclasses.replace(hand, mu=3.0)
    p = compass.vector(compass.resolve(rough.parameters))
    seen = set()
    for q, v, u in states:
        drive = compass.dynamics(q, v, p)
        free = np.linalg.solve(np.asarray(drive[0]), np.asarray(drive[2]) @ u - np.asarray(drive[1]).ravel())
        for which, mode in enumerate([Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]):
            normal = np.asarray(compass.acceleration[mode](q, v, u, p)[1]).ravel()[1]
            # normal acceleration = free[1] + indicator f_n = 0
            positive = indicator(compass, rough, q)[which] > 0
            assert (normal * free[1] < 0) == positive
            seen.add(bool(positive))
    assert seen == {True, False}
