"""The rimless wheel's Functions against a pendulum with inertia, and against one rigid body by hand."""

import numpy as np
import pytest

from gaitopt import Mode
from tests.newton_euler.wheel import HandWheel

WHEELS = [HandWheel(mu=0.3), HandWheel(spokes=6, kappa=0.5, slope=0.2, mu=0.9), HandWheel(8, 0.02, -0.1, 0.1)]


@pytest.fixture(params=WHEELS, ids=["ten spokes", "six spokes", "light rim"])
def hand(request):
    return request.param


def flat(output):
    return np.asarray(output).ravel()


def angles(hand, rng):
    return [(rng.uniform(-hand.half, hand.half), rng.normal()) for _ in range(20)]


def test_stance_is_a_pendulum_with_inertia(wheel, hand, rng):
    p = wheel.vector(wheel.resolve(hand.parameters))
    for theta, rate in angles(hand, rng):
        acceleration = flat(wheel.acceleration[Mode.STICK]([0, 0, theta], [0, 0, rate], [], p)[0])
        # (m l^2 + I_c) theta'' = m g l sin(theta + slope), with m = l = g = 1
        expected = np.sin(theta + hand.slope) / (1 + hand.kappa)
        np.testing.assert_allclose(acceleration, [0, 0, expected], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_contact_force_is_newtons(wheel, hand, rng, mode):
    p = wheel.vector(wheel.resolve(hand.parameters))
    for theta, rate in angles(hand, rng):
        v = [float(mode.sign), 0.0, rate]
        acceleration, force = map(flat, wheel.acceleration[mode]([0, 0, theta], v, [], p))
        slide, turn, tangential, normal = hand.motion(theta, rate, mode.sign)
        np.testing.assert_allclose(acceleration, [slide, 0, turn], rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(force, [tangential, normal], rtol=1e-9, atol=1e-11)


def test_physical_units_scale_out(wheel, rng):
    """Times scale with sqrt(l/g) and forces with m g, whatever l, m and g are."""
    unit = wheel.vector(wheel.resolve({**WHEELS[0].parameters, "friction": 0.3}))
    other = wheel.resolve({**WHEELS[0].parameters, "leg_length": 0.6, "mass": 7.0, "gravity": 9.8, "friction": 0.3})
    scale = np.sqrt(9.8 / 0.6)
    for theta, rate in angles(WHEELS[0], rng):
        a, f = map(flat, wheel.acceleration[Mode.SLIP_FORWARD]([0, 0, theta], [1, 0, rate], [], unit))
        b, g = map(
            flat,
            wheel.acceleration[Mode.SLIP_FORWARD]([0, 0, theta], [1, 0, rate * scale], [], wheel.vector(other)),
        )
        np.testing.assert_allclose(b, [a[0] * 9.8, 0, a[2] * scale**2], rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(g, f * 7.0 * 9.8, rtol=1e-9, atol=1e-10)


def test_the_next_spoke_lands_when_the_wheel_has_turned_half_the_angle_between_spokes(wheel):
    hand = WHEELS[0]
    p = wheel.vector(wheel.resolve(hand.parameters))
    q = [0.3, 0.0, hand.half]
    position, velocity, _ = map(flat, wheel.landing(q, [0, 0, 2.0], p))
    guard, rate, armed = (float(part) for part in wheel.touchdown(q, [0, 0, 2.0], p))
    np.testing.assert_allclose(position, [0.3 + 2 * np.sin(np.pi / 10), 0.0], atol=1e-15)
    # Turning clockwise about the standing foot, the landing foot, one chord ahead of it, moves straight down.
    np.testing.assert_allclose(velocity, [0.0, -2.0 * 2 * np.sin(np.pi / 10)], atol=1e-14)
    assert (guard, rate) == (0.0, -2.0)
    assert armed > 0


def test_the_wheel_is_down_once_it_has_rolled_back_past_its_start(wheel):
    p = wheel.vector(wheel.resolve(WHEELS[0].parameters))
    start = -WHEELS[0].half
    assert float(wheel.upright([0, 0, start], p)) > 0
    assert float(wheel.upright([0, 0, start - 1e-6], p)) < 0
