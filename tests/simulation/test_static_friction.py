"""Static friction above kinetic friction: a stuck foot holds more force than a sliding one."""

import numpy as np
import pytest

from gaitopt import GaitProblem, Ground, InputError, Limits, compass_biped, rimless_wheel, simulate, solve, verify

RATIO = 1.15


def test_a_wheel_sticks_until_the_static_limit_and_slides_with_the_kinetic_one():
    wheel, start = rimless_wheel(), ([0, 0, -np.pi / 10], [0, 0, 2.4])
    slope = np.deg2rad(13)
    plain = simulate(wheel, *start, {"slope": slope, "friction": 0.3})
    static = simulate(wheel, *start, {**Ground(slope=slope, friction=0.3, static_friction=0.3 * RATIO)})
    onset = [next(event for event in walk.events if event.name == "slip+") for walk in (plain, static)]
    assert onset[1].time > onset[0].time
    ratios = [
        np.abs(walk.motion.segments[0].force[0, -1] / walk.motion.segments[0].force[1, -1]) for walk in (plain, static)
    ]
    assert ratios == pytest.approx([0.3, 0.3 * RATIO], abs=1e-9)
    sliding = static.motion.segments[1].force
    np.testing.assert_allclose(sliding[0], -0.3 * sliding[1], rtol=1e-9)


@pytest.mark.slow
def test_a_gait_whose_slip_begins_at_the_static_limit_survives_its_replay():
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="stick slip- | stick",
        parameters={"static_friction_ratio": RATIO},
        friction=0.12,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
    )
    gait = verify(solve(problem))
    assert gait.status.ok, gait.status
    assert gait.verification.passed
    stick, slip = gait.motion.segments
    assert abs(stick.force[0, -1] / stick.force[1, -1]) == pytest.approx(0.12 * RATIO, rel=1e-6)
    np.testing.assert_allclose(np.abs(slip.force[0] / slip.force[1]), 0.12, rtol=1e-6)
    plain = verify(solve(problem.replace(parameters={})))
    assert gait.cost_of_transport < plain.cost_of_transport  # more grip costs no more


def test_ground_is_checked():
    with pytest.raises(InputError, match=r"static_friction must be at least friction = 0\.5, got 0\.4"):
        Ground(friction=0.5, static_friction=0.4)
    with pytest.raises(InputError, match="slope must be"):
        Ground(slope=2.0)
    assert dict(Ground(slope=0.1, friction=0.5)) == {"slope": 0.1, "friction": 0.5, "static_friction_ratio": 1.0}
