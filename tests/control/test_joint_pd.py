"""Joint feedback about a reference."""

import numpy as np
import pytest

from gaitopt import (
    InputError,
    ScipyEngine,
    compass_biped,
    joint_pd,
    load,
    replay,
)
from gaitopt.control.reference import reference


@pytest.fixture(scope="module")
def gait():
    return load("docs/examples/compass_slip.h5")


def torque(law, clock, q, v):
    return law.torque_at(clock, q, v)


def on_plan(gait, part, k):
    segment = gait.motion.segments[part]
    return segment.time[k], segment.q[:, k], segment.v[:, k], segment.torque[:, k]


@pytest.mark.parametrize(("part", "k"), [(0, 0), (0, 7), (1, 0), (1, 33), (1, -1)])
def test_on_the_plan_it_asks_for_the_planned_torque(gait, part, k):
    clock, q, v, planned = on_plan(gait, part, k)
    law = joint_pd(compass_biped(), gait.motion, stiffness=100, damping=10)
    assert torque(law, clock, q, v) == pytest.approx(planned, abs=1e-8)


def test_reference_meets_the_motion_between_its_samples(gait):
    robot = compass_biped()
    walk = replay(gait, robot, engine=ScipyEngine()).motion
    plan, law = reference(robot, gait.motion), joint_pd(robot, gait.motion, stiffness=1, damping=1)
    assert plan.duration == gait.period
    for segment in walk.segments:
        for k in range(0, segment.time.size - 1, 7):
            error = torque(law, segment.time[k], segment.q[:, k], segment.v[:, k]) - segment.torque[:, k]
            assert np.max(np.abs(error)) < 5e-7


def test_errors_of_joints_are_corrected(gait):
    clock, q, v, planned = on_plan(gait, 1, 20)
    law = joint_pd(compass_biped(), gait.motion).with_gains({"ankle_stiffness": 3, "hip_damping": 2})
    away = torque(law, clock, q + np.array([0, 0, 0.01, 0.02]), v + np.array([0, 0, 0.1, -0.3]))
    assert away - planned == pytest.approx([-3 * 0.01, -2 * (0.1 - 0.3)], abs=1e-8)


def test_torque_keeps_its_limits(gait):
    clock, q, v, _ = on_plan(gait, 1, 20)
    law = joint_pd(compass_biped(), gait.motion, stiffness=1e4, torque_limit={"hip": 2.5})
    assert abs(torque(law, clock, q + np.array([0, 0, 0.1, 0.1]), v)[0]) > 100
    assert torque(law, clock, q + np.array([0, 0, 0.1, 0.1]), v)[1] == -2.5
    assert torque(law, clock, q - np.array([0, 0, 0.1, 0.1]), v)[1] == 2.5


def test_mistakes_are_explained(gait):
    robot = compass_biped()
    with pytest.raises(InputError, match=r"no gain 'hip_stifness'\. Did you mean 'hip_stiffness'"):
        joint_pd(robot, gait.motion).with_gains({"hip_stifness": 1})
    with pytest.raises(InputError, match="torque_limit of hip"):
        joint_pd(robot, gait.motion, torque_limit={"hip": -1})
    with pytest.raises(InputError, match="no actuator 'knee'"):
        joint_pd(robot, gait.motion, torque_limit={"knee": 1})


def test_gains_must_be_finite(compass, slip_gait):
    with pytest.raises(InputError, match="ankle_damping must be a finite number, got nan"):
        joint_pd(compass, slip_gait.motion, stiffness=1, damping=np.nan)
