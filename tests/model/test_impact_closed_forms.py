"""Impacts against closed forms of the study and against momenta taken body by body."""

import numpy as np
import pytest

from gaitopt import Mode
from gaitopt.model import solve_impact
from tests.newton_euler.compass import HandCompass
from tests.newton_euler.wheel import HandWheel

SIGNS = {Mode.STICK: 0, Mode.SLIP_FORWARD: 1, Mode.SLIP_BACKWARD: -1}


def test_sticking_wheel_keeps_beta_of_its_rate_and_has_the_studys_impulse_ratio(wheel):
    """Gamus & Or (2015): beta = (cos(2 pi/n) + kappa) / (1 + kappa), L_t / L_n = -0.2374 at n = 10, kappa = 1/3."""
    hand = HandWheel()
    p = wheel.vector(wheel.resolve(hand.parameters))
    rate = 1.3
    impact = solve_impact(wheel, np.array([0, 0, hand.half]), np.array([0, 0, rate]), p)
    beta = (np.cos(2 * np.pi / 10) + 1 / 3) / (1 + 1 / 3)
    assert impact.mode is Mode.STICK
    assert impact.v_plus[2] / rate == pytest.approx(beta, rel=1e-14)
    assert beta**2 == pytest.approx(0.734042, abs=5e-7)
    assert impact.impulse[0] / impact.impulse[1] == pytest.approx(-0.2374, abs=5e-5)
    # Both rates turn the wheel about a spoke's end: T = (1 + kappa) rate^2 / 2.
    assert impact.energy_lost == pytest.approx((1 + 1 / 3) * rate**2 * (1 - beta**2) / 2, rel=1e-13)
    # The trailing foot then rises as the wheel turns about the landing foot, one chord ahead.
    assert impact.separation == pytest.approx(beta * rate * 2 * np.sin(np.pi / 10), rel=1e-13)


def test_the_wheel_slips_at_impact_only_below_its_impulse_ratio(wheel):
    for friction, mode in ((0.2375, Mode.STICK), (0.2373, Mode.SLIP_FORWARD), (0.0, Mode.SLIP_FORWARD)):
        p = wheel.vector(wheel.resolve(HandWheel(mu=friction).parameters))
        assert solve_impact(wheel, np.array([0, 0, np.pi / 10]), np.array([0, 0, 1.0]), p).mode is mode


def test_impulse_moves_the_wheel_by_newton_and_euler(wheel, rng):
    hand = HandWheel(mu=0.1)
    p = wheel.vector(wheel.resolve(hand.parameters))
    s, c = np.sin(hand.half), np.cos(hand.half)
    for _ in range(10):
        slide, rate = rng.normal(), rng.uniform(0.5, 2)
        impact = solve_impact(wheel, np.array([0, 0, hand.half]), np.array([slide, 0, rate]), p)
        centre = [np.array([v[0] + c * v[2], v[1] - s * v[2]]) for v in ([slide, 0, rate], impact.v_plus)]
        np.testing.assert_allclose(centre[1] - centre[0], impact.impulse, rtol=1e-12, atol=1e-13)
        # Landing foot at (+s, -c) from the centre: clockwise moment r_y f_x - r_x f_y.
        spin = (-c * impact.impulse[0] - s * impact.impulse[1]) / hand.kappa
        assert impact.v_plus[2] - rate == pytest.approx(spin, rel=1e-12, abs=1e-13)


def test_compass_impact_keeps_angular_momentum_about_landing_foot_and_hip(compass, rng):
    seen = set()
    for friction in [0.02, 0.14, 0.5] * 30:
        hand = HandCompass(mu=friction)
        p = compass.vector(compass.resolve(hand.parameters))
        th, v = rng.uniform(0.05, 0.5), np.array([0.3 * rng.normal(), 0, *rng.normal(size=2)])
        th = np.array([th, th])
        if hand.landing(th, v[:2], v[2:])[1][1] > 0:
            v = -v
        impact = solve_impact(compass, np.array([0, 0, *th]), v, p)
        after, impulse = hand.impact(th, v, SIGNS[impact.mode])
        seen.add(impact.mode)
        np.testing.assert_allclose(impact.v_plus, after, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(impact.impulse, impulse, rtol=1e-9, atol=1e-10)
    assert len(seen) == 3


def test_gait_a_of_the_study_has_its_impulse_ratio(compass):
    """Gamus & Or (2015), Gait A: L_t / L_n = -0.14467; so its impact sticks at mu = 0.1447 and slips at 0.1446."""
    th, after = -0.147836890, np.array([0.732796791, -0.500667882])
    hand = HandCompass(slope=np.deg2rad(1), mu=0.5)
    _, _, _, rates = hand.walk([0], [th, th], [0, 0, *after], 0)
    np.testing.assert_allclose(rates, after, atol=2e-9)
    for friction, mode in ((0.1447, Mode.STICK), (0.1446, Mode.SLIP_FORWARD)):
        p = compass.vector(compass.resolve({"friction": friction}))
        before = _before_landing(hand, th, after)
        impact = solve_impact(compass, np.array([0, 0, -th, -th]), before, p)
        assert impact.mode is mode
        if mode is Mode.STICK:
            assert impact.impulse[0] / impact.impulse[1] == pytest.approx(-0.14467, abs=5e-6)


def _before_landing(hand, th, after):
    """Return the rates just before the touchdown of Gait A: its sticking impact, inverted."""
    swapped = -after[::-1]

    def result(w):
        return hand.impact(np.array([-th, -th]), np.array([0, 0, *w]), 0)[0][2:]

    matrix = np.array([result(np.array([1.0, 0])), result(np.array([0, 1.0]))]).T
    return np.array([0, 0, *np.linalg.solve(matrix, swapped)])
