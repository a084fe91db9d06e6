"""Robots on uneven ground: the same mechanics as on a plane of another slope, and steps of stairs."""

from pathlib import Path

import numpy as np
import pytest

from gaitopt import GaitProblem, InputError, Limits, compass_biped, ledger, solve, verify
from gaitopt.cli.script import load_script
from gaitopt.model import Mode, solve_impact
from gaitopt.model.contacts.mode import PHYSICAL
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.uneven_ground import adapt_to_uneven_ground

ROOT = Path(__file__).parents[2]
COMPASS = compass_biped()
UNEVEN = adapt_to_uneven_ground(COMPASS)
INCLINE, SLOPE = 0.12, 0.05
SHIFT = np.array([0, 0, INCLINE, -INCLINE])
"""Angles from the normal of inclined ground instead of that of the plane: forward for the stance leg, backward for the
swing leg."""

PLANE = COMPASS.vector(COMPASS.resolve({"slope": SLOPE - INCLINE, "friction": 0.2}))
GROUND = UNEVEN.vector(UNEVEN.resolve({"slope": SLOPE, "friction": 0.2, "incline": INCLINE, "next_incline": INCLINE}))


def states(count=5):
    random = np.random.default_rng(0)
    return [(np.append([0, 0], random.normal(0, 0.2, 2)), random.normal(0, 1, 4)) for _ in range(count)]


@pytest.mark.parametrize("mode", PHYSICAL, ids=lambda mode: mode.name)
def test_accelerations_on_inclined_ground_are_those_on_a_plane_of_that_slope(mode):
    for q, v in states():
        here = UNEVEN.acceleration[mode](q, v, [1, 2], GROUND)
        there = COMPASS.acceleration[mode](q + SHIFT, v, [1, 2], PLANE)
        for one, other in zip(here, there, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)


def test_touchdown_and_impact_on_inclined_ground_are_those_on_a_plane_of_that_slope():
    pose, rates = np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.6, -0.1])
    here = solve_impact(UNEVEN, pose - SHIFT, rates, GROUND)
    there = solve_impact(COMPASS, pose, rates, PLANE)
    assert here.mode is there.mode is Mode.SLIP_FORWARD
    np.testing.assert_allclose(here.impulse, there.impulse, atol=1e-12)
    np.testing.assert_allclose(here.v_plus, there.v_plus, atol=1e-12)
    guard, rate, armed = UNEVEN.touchdown(pose - SHIFT, rates, GROUND)
    assert float(guard) == pytest.approx(0, abs=1e-12)
    assert float(rate) < 0 < float(armed)


def test_the_frame_of_the_next_foothold_is_that_of_its_incline():
    p = UNEVEN.vector(UNEVEN.resolve({"next_incline": INCLINE, "rise": 0.03}))
    q, v = np.array([0, 0, 0.1, 0.2]), np.array([0, 0, 0.6, -0.1])
    place, velocity, _ = (
        np.asarray(part).ravel() for part in COMPASS.landing(q, v, COMPASS.vector(COMPASS.resolve({})))
    )
    q_next, v_next = (np.asarray(part).ravel() for part in UNEVEN.swap(q, v, p))
    turn = np.array([[np.cos(INCLINE), np.sin(INCLINE)], [-np.sin(INCLINE), np.cos(INCLINE)]])
    np.testing.assert_allclose(q_next[:2], turn @ place, atol=1e-14)
    np.testing.assert_allclose(v_next[:2], turn @ velocity, atol=1e-14)
    np.testing.assert_allclose(np.asarray(UNEVEN.unswap(q, v_next, p)).ravel(), v, atol=1e-13)
    height = place[1] - 0.03 - np.tan(INCLINE) * place[0]
    assert float(UNEVEN.touchdown(q, v, p)[0]) == pytest.approx(height, abs=1e-14)


@pytest.mark.parametrize("rise", [0.03, -0.03])
def test_a_periodic_gait_climbs_or_descends_stairs(rise):
    gait = verify(
        solve(
            GaitProblem(
                robot=UNEVEN,
                parameters={"rise": rise},
                sequence="stick | stick",
                friction=0.3,
                speed=0.6,
                step_length=0.45,
                limits=Limits(torque=20),
                objective="torque_squared",
            )
        )
    )
    assert gait.status.ok, gait.verification
    assert gait.motion.jumps[0].q_next[1] == pytest.approx(rise, abs=1e-10)
    book, weight = ledger(gait.motion), 10 * 9.8  # two legs of 4 kg and a hip of 2 kg
    assert book.gravity == pytest.approx(-weight * rise, rel=1e-9)
    assert book.relative_residual < 1e-9


def test_only_walkers_with_point_feet_are_accepted():
    assert adapt_to_uneven_ground(UNEVEN) is UNEVEN
    with pytest.raises(InputError, match="robot must be a Robot"):
        adapt_to_uneven_ground(round_foot_walker())
    with pytest.raises(InputError, match="round feet; uneven ground is accepted for point feet only"):
        adapt_to_uneven_ground(load_script(ROOT / "problems" / "round_feet_slip.py")().robot)
