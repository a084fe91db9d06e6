"""The passive compass gaits of Gamus & Or (2015), reproduced to the printed digits by simulating one step."""

import numpy as np
import pytest

from gaitopt import Stop
from gaitopt.motion.gait import cone_margin


def section(walk):
    """Return (th1, th1d, th2d, xd) after the last touchdown."""
    jump = walk.motion.jumps[-1]
    assert jump.q_next[2] == pytest.approx(jump.q_next[3], abs=1e-12)
    return np.array([jump.q_next[2], *jump.v_next[2:], jump.v_next[0]])


def sequence(walk, step=0):
    assert walk.stop is Stop.STEPS_DONE
    return str(walk.motion.sequence(step))


def test_gait_a_sticks(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=0.3)
    assert sequence(walk) == "stick | stick"
    np.testing.assert_allclose(section(walk), [*gait_a["z"], 0.0], atol=2e-9)
    assert walk.motion.period == pytest.approx(gait_a["T"], abs=3e-9)
    assert walk.motion.travel == pytest.approx(0.471356685, abs=2e-9)
    assert walk.motion.travel == pytest.approx(2 * 1.6 * np.sin(0.147836890), abs=5e-9)
    assert walk.motion.jumps[0].ratio == pytest.approx(-0.14467, abs=5e-6)


def test_walking_on_converges_to_every_printed_digit_of_gait_a(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=0.3, steps=60)
    before, last = walk.motion.jumps[-2:]
    np.testing.assert_allclose(section(walk), [*gait_a["z"], 0.0], atol=6e-10)
    assert last.time - before.time == pytest.approx(gait_a["T"], abs=6e-10)
    assert last.q_next[0] - before.q_next[0] == pytest.approx(0.471356685, abs=6e-10)


def test_gait_a_needs_the_critical_friction_of_the_study(compass_walk, gait_a):
    """0.17492, reached just after the impact."""
    segment = compass_walk(gait_a["z"], mu=0.3).motion.segments[0]
    ratio = np.abs(segment.force[0]) / segment.force[1]
    assert ratio.max() == pytest.approx(0.17492, abs=5e-6)
    assert ratio.argmax() == 0
    assert sequence(compass_walk(gait_a["z"], mu=0.175)) == "stick | stick"
    assert sequence(compass_walk(gait_a["z"], mu=0.1749)) == "slip+ stick | stick"


def test_gait_a_without_friction_limit_is_the_same(compass_walk, gait_a):
    finite, infinite = (compass_walk(gait_a["z"], mu=mu) for mu in (0.3, np.inf))
    np.testing.assert_allclose(section(infinite), section(finite), atol=1e-11)
    assert cone_margin(infinite.motion) == 1.0


def test_gait_b_slips_after_a_sticking_impact_and_before_the_next(compass_walk, gait_b):
    walk = compass_walk(gait_b["z"], mu=0.14)
    assert sequence(walk) == "slip+ stick slip- | stick"
    np.testing.assert_allclose(section(walk), [*gait_b["z"], 0.0], atol=3e-9)
    assert walk.motion.period == pytest.approx(gait_b["T"], abs=5e-7)


def test_gait_c_lands_sliding(compass_walk, gait_c):
    """Its largest multiplier is 1.8, and its state is printed to six digits, so it returns to five."""
    walk = compass_walk(gait_c["z"], xd=gait_c["xd"], mu=0.14)
    assert sequence(walk) == "slip+ stick | slip+"
    np.testing.assert_allclose(section(walk), [*gait_c["z"], gait_c["xd"]], atol=3e-6)
    assert walk.motion.period == pytest.approx(gait_c["T"], abs=1e-6)
    assert walk.motion.jumps[0].ratio == pytest.approx(-0.14, rel=1e-12)


def test_passive_gaits_lose_what_gravity_gives(compass_walk, passive_gait):
    """In a periodic gait friction and impact losses are m g L sin(slope), L the travel with the slide."""
    motion = compass_walk(passive_gait["z"], xd=passive_gait["xd"], mu=passive_gait["mu"]).motion
    friction = sum(segment.friction_work[-1] for segment in motion.segments)
    fallen = 10.0 * 9.8 * motion.travel * np.sin(np.deg2rad(1))
    error = 1e-5 if passive_gait["xd"] else 1e-7  # of the printed digits of the state
    assert friction + motion.jumps[0].energy_lost == pytest.approx(fallen, rel=error)


def jacobian(step, point, sizes=1e-6):
    columns = [(step(point + d) - step(point - d)) / (2 * sizes) for d in sizes * np.eye(point.size)]
    return np.array(columns).T


def multipliers(step, point):
    values = np.linalg.eigvals(jacobian(step, np.array(point)))
    return values[np.argsort(-np.abs(values))]


def test_multipliers_of_gait_a(compass_walk, gait_a):
    """0.48361 +- 0.51892 i and 0.38575 by central differences of the simulated return map."""
    values = multipliers(lambda z: section(compass_walk(z, mu=0.3))[:3], gait_a["z"])
    np.testing.assert_allclose(sorted(values[:2], key=np.imag), [0.48361 - 0.51892j, 0.48361 + 0.51892j], atol=1e-5)
    assert values[2].real == pytest.approx(0.38575, abs=1e-5)


def test_largest_multiplier_of_gait_b(compass_walk, gait_b):
    values = multipliers(lambda z: section(compass_walk(z, mu=0.14))[:3], gait_b["z"])
    assert abs(values[0]) == pytest.approx(0.8206, abs=1e-4)


def test_multipliers_of_gait_c(compass_walk, gait_c):
    """1.8235, -1.0695, 0.0579 and 0: unstable.  One vanishes, since the foot comes to rest in every step."""

    def step(z):
        return section(compass_walk(z[:3], xd=z[3], mu=0.14))

    values = multipliers(step, [*gait_c["z"], gait_c["xd"]])
    np.testing.assert_allclose(values.real, [1.8235, -1.0695, 0.0579, 0.0], atol=2e-4)
