"""A state that is nan ends a walk, and a plan that is nan does not pass its replay."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import Status, feedforward, simulate, verify
from gaitopt.model.contacts.impact import TouchdownMap


@pytest.mark.parametrize("name", ["q_next", "v_next"])
def test_a_planned_state_that_is_nan_is_refuted(slip_gait, name):
    jump = slip_gait.motion.jumps[0]
    after = getattr(jump, name).copy()
    after[-1] = np.nan
    motion = replace(slip_gait.motion, jumps=(replace(jump, **{name: after}),))
    verified = verify(replace(slip_gait, motion=motion))
    assert verified.status is Status.NOT_VERIFIED
    assert "state after touchdown deviates by inf" in verified.verification.reasons[0]


def test_an_impact_that_leaves_nan_ends_the_walk(compass):
    collision = compass.collision
    q, v, p = (ca.SX.sym(collision.name_in(i), collision.sparsity_in(i)) for i in range(3))
    velocity, mobility, spread = collision(q, v, p)
    broken = ca.Function("collision", [q, v, p], [velocity, mobility, spread * np.nan])
    robot = replace(compass, collision=broken)
    p = robot.vector(robot.resolve({"friction": 0.5}))
    impact, following = TouchdownMap(robot, p).solve(np.array([0, 0, 0.15, 0.15, 0, 0, 0.6, -0.1]))
    assert impact.mode is not None
    assert following is None


def test_torques_that_are_nan_end_the_walk(slip_gait, compass):
    first, *rest = slip_gait.motion.segments
    torque = first.torque.copy()
    torque[:, 3:] = np.nan
    motion = replace(slip_gait.motion, segments=(replace(first, torque=torque), *rest))
    walk = simulate(compass, first.q[:, 0], first.v[:, 0], motion.parameters, law=feedforward(compass, motion), steps=1)
    assert walk.stop.key == "singular"
