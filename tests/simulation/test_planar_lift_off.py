"""A foot that sticks without tangential force lifts off when its normal force vanishes."""

import numpy as np
import pytest

from gaitopt.model.robots.monopod import monopod
from gaitopt.ocp import solve_planar
from gaitopt.simulation import place_planar, simulate_planar, verify_planar
from tests.ocp.multicontact_examples import hop


@pytest.mark.parametrize("friction", [0.5, np.inf])
@pytest.mark.parametrize("leg", [0.35, 0.45, 0.5])
def test_a_vertical_monopod_lifts_off_where_its_spring_carries_the_foot(friction, leg):
    """From rest at a leg length: m s'' = k (0.6 - s) - m g of the body on its spring."""
    robot = monopod()
    q, v = place_planar(robot, {"x": 0, "phi": 0, "a": 0, "s": leg}, {"phi": 0, "a": 0, "s": 0}, {}, on=["foot"])
    rollout = simulate_planar(robot, q, v, {"friction": friction}, duration=0.2)
    (event,) = rollout.motion.events
    assert event.names == ("foot opens",)
    mass, stiffness, gravity, rest, foot = 8, 3000, 9.81, 0.6, 1
    frequency, middle = np.sqrt(stiffness / mass), rest - mass * gravity / stiffness
    length = rest + foot * gravity / stiffness
    assert event.q[robot.coordinates.index("s")] == pytest.approx(length, abs=1e-9)
    phase = np.arccos((length - middle) / (leg - middle))
    assert event.time == pytest.approx(phase / frequency, abs=1e-9)


@pytest.mark.parametrize("free", [{"foot_mass": (0.5, 2)}, {"stiffness": (2000, 5000)}])
def test_a_slip_that_ends_at_lift_off_within_rounding_is_omitted(free):
    """Both forces vanish at the planned lift-off; the error of the plan is a slip of about 1e-9 s before."""
    gait = verify_planar(solve_planar(hop(clearance=2e-3).replace(free=free)))
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.sequence == "foot stick > flight |"
