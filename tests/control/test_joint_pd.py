"""Joint feedback about a reference."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Coordinates,
    Drawing,
    InputError,
    PointMass,
    ScipyEngine,
    StepEnd,
    assemble,
    compass_biped,
    joint_pd,
    load,
    replay,
)
from gaitopt.control.reference import reference
from gaitopt.model.robots.compass import PARAMETERS


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
    walk = replay(gait, engine=ScipyEngine()).motion
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


def lever_biped():
    """Return a compass biped whose hip actuator works through a lever on a nonlinear function of the hip's angle."""
    c = Coordinates(("th1", "th2"), PARAMETERS)
    a, b = c.angle("th1"), c.angle("th2")
    hip = c.foot + c.parameter("leg_length") * ca.vertcat(ca.sin(a), ca.cos(a))
    foot = hip + c.parameter("leg_length") * ca.vertcat(ca.sin(b), -ca.cos(b))
    return assemble(
        "compass_biped",
        c,
        bodies=[PointMass(c.parameter("leg_mass"), hip), PointMass(1.0, (hip + foot) / 2)],
        step=StepEnd(landing=foot, touchdown=b - a, armed=a, exchange=[-b, -a], upright=ca.cos(a)),
        actuators={"ankle": a, "hip": c.parameter("hip_mass") * ca.sin(a + b)},
        drawing=Drawing({"hip": hip}, []),
        description="compass biped with a lever at its hip",
    )


def test_joints_that_are_no_linear_functions_of_the_angles_are_taken_at_the_state(gait):
    """At q = 0 with default parameters the lever's arm would be another."""
    clock, q, v, planned = on_plan(gait, 1, 20)
    parameters = {**gait.motion.parameters, "hip_mass": 3.0}
    motion = dataclasses.replace(gait.motion, parameters=parameters)
    law = joint_pd(lever_biped(), motion).with_gains({"hip_stiffness": 3, "hip_damping": 2})
    away = q + np.array([0, 0, 0.3, 0.2])
    arm = 3.0 * np.cos(away[2] + away[3])
    error = torque(law, clock, away, v + np.array([0, 0, 0.1, -0.3])) - planned
    assert error == pytest.approx([0, -arm * (3 * 0.5 + 2 * (0.1 - 0.3))], abs=1e-8)
