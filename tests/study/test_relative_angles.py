"""A robot in relative coordinates has the gaits, multipliers, basins and sweeps of the same robot in absolute ones.

Source of the expected values: the compass biped in absolute coordinates, by a change of variables.
"""

import math

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    Limits,
    ScipyEngine,
    assess_stability,
    basin,
    check_robot,
    compass_biped,
    find_cycles,
    joint_pd,
    solve,
    sweep,
    verify,
)
from gaitopt.study import ending_labels
from tests.walkers.relative_compass import relative_compass

ROBOTS = {"absolute": compass_biped, "relative": relative_compass}


def pose(robot, **changes):
    """Return a problem whose optimum does not depend on the coordinates."""
    return GaitProblem(
        robot=ROBOTS[robot](),
        sequence="slip+ stick | slip+",
        friction=0.14,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        transcription=Collocation(intervals=20),
        **changes,
    )


@pytest.fixture(scope="module")
def gaits():
    return {robot: verify(solve(pose(robot))) for robot in ROBOTS}


def sorted_multipliers(cycle):
    return np.array(sorted(cycle.multipliers, key=lambda m: (round(m.imag, 5), m.real)))


def test_the_robot_is_right():
    assert check_robot(relative_compass()).passed


def test_the_gait_is_the_same(gaits):
    assert all(gait.verification.passed for gait in gaits.values())
    costs = [gait.verification.cost_of_transport for gait in gaits.values()]
    assert costs[0] == pytest.approx(costs[1], rel=2e-4)  # accelerations of other angles are interpolated


@pytest.mark.parametrize(
    "law",
    [
        lambda robot, motion: None,
        lambda robot, motion: joint_pd(robot, motion, stiffness=20, damping=2, torque_limit=8),
        lambda robot, motion: joint_pd(robot, motion, stiffness=30, damping=2).with_gains({"hip_stiffness": 10}),
    ],
    ids=["open loop", "joint PD", "joint PD with two stiffnesses"],
)
def test_multipliers_are_the_same(gaits, law):
    """Errors of joint angles and torques of joints are the same in either coordinates."""
    absolute, relative = (
        assess_stability(gait, law(gait.robot, gait.motion), engine=ScipyEngine()) for gait in gaits.values()
    )
    assert sorted_multipliers(relative) == pytest.approx(sorted_multipliers(absolute), abs=1e-3)


def test_passive_gaits_are_the_same():
    parameters = {"slope": math.radians(1), "friction": 0.5}
    one, other = (next(c for c in find_cycles(make(), parameters, starts=16) if c.stable) for make in ROBOTS.values())
    assert other.period == pytest.approx(one.period, rel=1e-9)
    assert sorted_multipliers(other) == pytest.approx(sorted_multipliers(one), abs=1e-7)
    assert other.critical_friction.friction == pytest.approx(one.critical_friction.friction, rel=1e-8)


def test_basins_are_the_same():
    ground, rates = {"slope": math.radians(1), "friction": 0.5}, np.linspace(0.5, 1.0, 6)
    absolute = basin(compass_biped(), ground | {"th1": -0.147836, "th2_rate": -0.500668}, {"th1_rate": rates})
    relative = [
        basin(relative_compass(), ground | {"leg": -0.147836, "between_rate": rate - 0.500668}, {"leg_rate": [rate]})
        for rate in rates
    ]
    labels = ending_labels(absolute).tolist()
    assert [ending_labels(table).item() for table in relative] == labels
    assert len(set(labels)) > 1


@pytest.mark.slow
def test_sweeps_are_the_same():
    tables = [sweep(pose(robot), {"friction": [0.14, 0.2]}, starts=1) for robot in ROBOTS]
    costs = [table.cost_of_transport.values.ravel() for table in tables]
    assert np.all(np.isfinite(costs))
    assert costs[1] == pytest.approx(costs[0], rel=5e-4)
