"""The rimless-wheel gaits of Gamus & Or (2015): n = 10, kappa = 1/3, slope 13 deg, speeds per tau_c."""

import dataclasses

import numpy as np
import pytest

from gaitopt import Stop, simulate
from tests.newton_euler.wheel import HandWheel

UNIT = np.sqrt(4 / 3)
"""tau_c for m = l = g = 1."""
BETA = (np.cos(2 * np.pi / 10) + 1 / 3) / (4 / 3)
SLOPE = np.deg2rad(13)


def section(walk, step=-1):
    """Return (thd, xd) after a touchdown, per tau_c."""
    return walk.motion.jumps[step].v_next[[2, 0]] * UNIT


def sequences(walk):
    assert walk.stop is Stop.STEPS_DONE
    return [str(walk.motion.sequence(step)) for step in range(len(walk.motion.jumps))]


def type_a():
    """Energy over one step, then beta at impact: thd^2 = beta^2 (thd^2 + 4 sin(slope) sin(pi/n))."""
    return BETA * np.sqrt(4 * np.sin(SLOPE) * np.sin(np.pi / 10) / (1 - BETA**2))


def test_type_a_is_the_closed_form_and_the_printed_number(wheel_walk):
    assert type_a() == pytest.approx(0.876031, abs=5e-7)
    walk = wheel_walk(type_a())
    assert sequences(walk) == ["stick | stick"]
    assert section(walk)[0] == pytest.approx(type_a(), abs=1e-12)


def test_any_sticking_step_obeys_the_closed_form(wheel_walk):
    for rate in (0.1, 0.5, 0.95):
        expected = BETA * np.sqrt(rate**2 + 4 * np.sin(SLOPE) * np.sin(np.pi / 10))
        assert section(wheel_walk(rate))[0] == pytest.approx(expected, abs=1e-12)


def test_multiplier_of_type_a_is_beta_squared(wheel_walk):
    difference = section(wheel_walk(type_a() + 1e-5))[0] - section(wheel_walk(type_a() - 1e-5))[0]
    assert difference / 2e-5 == pytest.approx(BETA**2, abs=1e-8)


def test_critical_friction_of_type_a(wheel_walk, hand_wheel):
    """0.914, reached at theta = +pi/10."""
    segment = wheel_walk(type_a()).motion.segments[0]
    ratio = np.abs(segment.force[0]) / segment.force[1]
    end = np.sqrt(type_a() ** 2 + 4 * np.sin(SLOPE) * np.sin(np.pi / 10)) / UNIT
    _, _, tangential, normal = hand_wheel.motion(np.pi / 10, end)
    assert ratio.argmax() == ratio.size - 1
    assert ratio.max() == pytest.approx(abs(tangential) / normal, rel=1e-10)
    assert ratio.max() == pytest.approx(0.9141, abs=5e-5)
    assert sequences(wheel_walk(type_a(), mu=0.9142)) == ["stick | stick"]
    assert sequences(wheel_walk(type_a(), mu=0.9140)) == ["stick slip+ | stick"]


def test_basin_of_type_a_without_friction_limit(wheel_walk, hand_wheel):
    """0.0872 < thd < 0.9595: below, the wheel does not get over its spoke; above, it lifts off before the next."""
    least = np.sqrt(2 * (1 - np.cos(SLOPE - np.pi / 10)))
    assert least == pytest.approx(0.0872, abs=5e-5)
    assert wheel_walk(least * 0.9999).stop is Stop.FELL
    assert wheel_walk(least * 1.0001).stop is Stop.STEPS_DONE
    assert wheel_walk(0.95948).stop is Stop.STEPS_DONE
    lifted = wheel_walk(0.9596)
    assert lifted.stop is Stop.LIFT_OFF
    # There the normal force is nil, by the pendulum's own forces.
    state = lifted.motion.segments[-1]
    assert hand_wheel.motion(state.q[2, -1], state.v[2, -1])[3] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mu", "sequence"),
    [
        (0.3, "stick slip+ | stick"),
        (0.27, "stick slip+ | stick"),
        (0.265, "slip+ stick slip+ | stick"),
        (0.2455, "slip+ stick slip+ | stick"),
        (0.2445, "slip+ stick slip+ | slip+"),
        (0.2315, "slip+ stick slip+ | slip+"),
    ],
)
def test_types_b_and_c_are_reached_and_have_the_sequences_of_the_study(wheel_walk, mu, sequence):
    """B: `stick slip+ | stick` above 0.2676, with a first slip down to 0.2450; C from there to tan(slope) = 0.23087."""
    walk = wheel_walk(0.88, mu=mu, steps=90)
    assert sequences(walk)[-1] == sequence
    np.testing.assert_allclose(section(walk), section(walk, -2), atol=1e-8)


def test_type_b_at_friction_0_3(wheel_walk):
    """thd* = 0.88075, multiplier 0.7623."""
    assert section(wheel_walk(0.88075, mu=0.3))[0] == pytest.approx(0.88075, abs=2e-6)
    difference = section(wheel_walk(0.88075 + 1e-5, mu=0.3))[0] - section(wheel_walk(0.88075 - 1e-5, mu=0.3))[0]
    assert difference / 2e-5 == pytest.approx(0.7623, abs=1e-4)


@pytest.mark.parametrize("xd", [0.2, 0.9])
def test_type_d_slides_all_along_and_loses_the_same_speed_in_every_step(wheel_walk, xd):
    """mu = 0.3: thd* = 1.07204; xd changes by g T (sin(slope) - mu cos(slope)) = -0.0517, whatever it is."""
    walk = wheel_walk(1.07204, xd=xd, mu=0.3)
    assert sequences(walk) == ["slip+ | slip+"]
    rate, speed = section(walk)
    assert rate == pytest.approx(1.07204, abs=3e-6)
    change = walk.motion.period * (np.sin(SLOPE) - 0.3 * np.cos(SLOPE)) * UNIT
    assert change == pytest.approx(-0.0517, abs=5e-5)
    assert speed - xd == pytest.approx(change, abs=1e-5)


def test_type_d_keeps_its_speed_where_friction_balances_the_slope(wheel_walk):
    mu = np.tan(SLOPE)
    walk = wheel_walk(1.05, xd=0.5, mu=mu, steps=40)
    assert sequences(walk)[-1] == "slip+ | slip+"
    assert section(walk)[1] == pytest.approx(section(walk, -2)[1], abs=1e-9)


def test_multiplier_of_type_d(wheel_walk):
    difference = [section(wheel_walk(1.07203813 + d, xd=0.5, mu=0.3))[0] for d in (1e-5, -1e-5)]
    assert (difference[0] - difference[1]) / 2e-5 == pytest.approx(0.356, abs=5e-4)


def test_cascade_from_d_to_b(wheel_walk):
    """From thd = 1.12, xd = 0.7 at mu = 0.3: quick convergence to D, the foot stops at step 15, then B."""
    walk = wheel_walk(1.12, xd=0.7, mu=0.3, steps=60)
    spelled = sequences(walk)
    assert spelled[:14] == ["slip+ | slip+"] * 14
    assert spelled[14] == "slip+ | stick"
    assert spelled[15:] == ["stick slip+ | stick"] * 45
    assert section(walk, 10)[0] == pytest.approx(1.07204, abs=1e-5)
    assert section(walk)[0] == pytest.approx(0.88075, abs=1e-5)


def test_benchmark_of_six_spokes(wheel_walk):
    """n = 6, kappa = 1/2, slope 0.2: thd* = 0.460341126609 per sqrt(l/g), multiplier 4/9 (friction unlimited)."""
    robot = HandWheel(spokes=6, kappa=0.5, slope=0.2)
    unit = np.sqrt(1.5)

    def step(rate):
        return wheel_walk(rate * unit, robot=robot).motion.jumps[0].v_next[2]

    assert step(0.460341126609) == pytest.approx(0.460341126609, abs=1e-12)
    near = [step(0.460341126609 + d) for d in (1e-5, -1e-5)]
    assert (near[0] - near[1]) / 2e-5 == pytest.approx(4 / 9, abs=1e-8)


def test_a_wheel_of_another_size_walks_the_same_in_its_own_time(wheel, engine, hand_wheel):
    """Everything scales with l and sqrt(l/g): the same walk with l = 0.6 m, g = 9.8 m/s2, 7 kg."""
    hand = dataclasses.replace(hand_wheel, mu=0.26)
    small = {**hand.parameters, "leg_length": 0.6, "gravity": 9.8, "mass": 7.0}
    time = np.sqrt(0.6 / 9.8)
    start = [0, 0, -hand.half]
    one = simulate(wheel, start, [0, 0, 0.8], hand.parameters, engine=engine)
    two = simulate(wheel, start, [0, 0, 0.8 / time], small, engine=engine)
    assert two.motion.period == pytest.approx(one.motion.period * time, rel=1e-10)
    assert two.motion.travel == pytest.approx(one.motion.travel * 0.6, rel=1e-10)
    assert two.motion.sequence() == one.motion.sequence()
