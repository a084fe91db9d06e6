"""Passive walking on round feet: reference numbers, finite differences, and the limit of point feet.

The reference numbers are no published measurements.  They were computed independently of this package, twice: with
hand-written equations of motion and with another set of coordinates and another integrator; both agree in all digits.
The walker: hip 1 kg, legs 0.5 kg with 0.02 kg m^2, 1 m from the hip to the centre of the foot's arc, centre of mass
0.5 m below the hip, radius 0.2 m, gravity 1 m/s^2, slope 0.01; the foot does not slip.
"""

import numpy as np
import pytest

from gaitopt import assess_stability, compass_biped, feedforward, find_cycles, joint_pd, lqr, simulate
from gaitopt.control.law import passive
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from gaitopt.stability.cycle_search import find_cycle

from .conftest import COMPASS
from .test_multipliers import central_differences

# The references count angles a (stance) and b (swing) counter-clockwise from straight down: th1 = -a, th2 = b.
STATE = [-0.1894382832527, 0.2390109878129, -0.1876139814681]
PERIOD = 2.427955842630
MULTIPLIERS = [0.37046539 - 0.18370392j, 0.37046539 + 0.18370392j, 0.43344487]


@pytest.fixture(scope="module")
def passive_walk(passive_rolling):
    return passive_rolling


@pytest.fixture(scope="module")
def passive_gait(passive_walk, cycle):
    return cycle(passive_walk.robot, passive_walk.parameters, [*STATE, 0.0])


def check_reference(gait, accuracy):
    assert gait.sequence == "stick | stick"
    assert gait.z == pytest.approx(STATE, abs=accuracy)
    assert gait.period == pytest.approx(PERIOD, abs=10 * accuracy)
    found = sorted(gait.multipliers, key=lambda m: (m.real, m.imag))
    assert np.array(found) == pytest.approx(MULTIPLIERS, abs=1e-8)


def test_the_periodic_gait_is_the_reference(passive_gait):
    check_reference(passive_gait, accuracy=1e-12)


def test_the_fast_engine_reproduces_all_digits_of_the_reference(passive_walk):
    pytest.importorskip("heyoka")
    robot = passive_walk.robot
    p = robot.vector(robot.resolve(passive_walk.parameters))
    walker = Walker(robot, passive(robot), p, HeyokaEngine())
    check_reference(find_cycle(walker, np.array([*STATE, 0.0])), accuracy=1e-13)


def test_a_search_without_a_start_finds_it(passive_walk):
    stable = [gait for gait in find_cycles(passive_walk.robot, passive_walk.parameters, starts=40) if gait.stable]
    assert [gait.z.tolist() for gait in stable] == [pytest.approx(STATE, abs=1e-9)]


def test_its_multipliers_agree_with_finite_differences(passive_walk, passive_gait):
    numerical = central_differences(passive_walk.robot, passive_walk.parameters, passive_gait)
    assert np.max(np.abs(numerical - passive_gait.derivative)) < 1e-8


def test_gravity_gives_what_the_impact_takes(passive_gait):
    parameters = passive_gait.parameters
    weight = (parameters["hip_mass"] + 2 * parameters["leg_mass"]) * parameters["gravity"]
    assert passive_gait.energy.gravity == pytest.approx(weight * np.sin(0.01) * passive_gait.travel, rel=1e-9)
    assert passive_gait.energy.impact_loss == pytest.approx(passive_gait.energy.gravity, rel=1e-9)


def test_feet_of_vanishing_radius_have_the_multipliers_of_point_feet(passive_walk, cycle):
    start = [-0.1478, 0.7328, -0.5007, 0.0]
    pointed = cycle(compass_biped(), COMPASS, start)
    length = {"leg_length": 1.6, "leg_com": 0.8, "leg_mass": 4.0, "hip_mass": 2.0, "gravity": 9.8, "leg_inertia": 0.0}
    values = {**length, **COMPASS}
    gaits = [cycle(passive_walk.robot, {**values, "foot_radius": radius}, start) for radius in (0.0, 1e-7)]
    multipliers = [np.sort_complex(gait.multipliers) for gait in (pointed, *gaits)]
    assert multipliers[1] == pytest.approx(multipliers[0], abs=1e-9)
    assert multipliers[2] == pytest.approx(multipliers[0], abs=1e-5)
    assert np.any(multipliers[2] != multipliers[0])


@pytest.fixture(scope="module")
def laws(rolling, rolling_gait):
    robot, motion = rolling.robot, rolling_gait.motion
    return {
        "open loop": feedforward(robot, motion),
        "joint_pd": joint_pd(robot, motion, stiffness=200, damping=20),
        "lqr": lqr(robot, motion),
    }


@pytest.mark.parametrize("name", ["open loop", "joint_pd", "lqr"])
def test_laws_walk_the_gait_that_slips_and_rolls(rolling, rolling_gait, laws, name):
    law = laws[name]
    gait = assess_stability(rolling_gait, law)
    assert gait.sequence == "slip+ stick | slip+"
    assert np.all(np.isfinite(gait.multipliers))
    if name == "lqr":
        assert gait.radius < 0.9


def test_both_engines_agree_on_a_gait_that_slips_and_rolls(rolling, rolling_gait, laws):
    fast, reference = (
        assess_stability(rolling_gait, laws["open loop"], engine=engine) for engine in (None, ScipyEngine())
    )
    assert np.sort_complex(reference.multipliers) == pytest.approx(np.sort_complex(fast.multipliers), abs=1e-6)


def test_a_stabilised_walk_rolls_on_for_many_steps(rolling, rolling_gait, laws):
    first = rolling_gait.motion.segments[0]
    walk = simulate(
        rolling.robot, first.q[:, 0], first.v[:, 0], rolling_gait.motion.parameters, law=laws["lqr"], steps=8
    )
    assert [str(walk.motion.sequence(step)) for step in range(8)] == ["slip+ stick | slip+"] * 8
    assert walk.motion.travel == pytest.approx(8 * 0.5, abs=1e-5)
