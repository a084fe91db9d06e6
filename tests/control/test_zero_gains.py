"""Laws with zero gains beside the open loop."""

import numpy as np
import pytest

from gaitopt import (
    ScipyEngine,
    by_stance_angle,
    computed_torque,
    feedforward,
    joint_pd,
    state_feedback,
    step_to_step,
)
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker


def zero_gains(name, robot, motion):
    pieces = sum(segment.time.size - 1 for segment in motion.segments)
    return {
        "joint PD": lambda: joint_pd(robot, motion),
        "state feedback": lambda: state_feedback(robot, motion, np.zeros((pieces, 2, 2, 5))),
        "step to step": lambda: step_to_step(
            robot, feedforward(robot, motion), np.zeros(4), np.zeros((4, 4)), windows=2, duration=motion.period
        ),
        "computed torque": lambda: computed_torque(robot, motion),
    }[name]()


def away(gait):
    first = gait.motion.segments[0]
    return np.concatenate([first.q[:, 0], first.v[:, 0]]) + np.array([0, 0, 0.002, 0.002, 0.01, 0, 0.02, -0.05])


@pytest.mark.parametrize("index", ["clock", "angle"])
@pytest.mark.parametrize("engine", [default_engine(), ScipyEngine()], ids=lambda engine: engine.name)
@pytest.mark.parametrize("name", ["joint PD", "state feedback", "step to step"])
def test_zero_gains_are_the_open_loop(compass, slip_gait, name, engine, index):
    motion, p = slip_gait.motion, compass.vector(slip_gait.motion.parameters)
    laws = [feedforward(compass, motion), zero_gains(name, compass, motion)]
    if index == "angle":
        laws = [by_stance_angle(compass, motion, law) for law in laws]
    steps = [Walker(compass, law, p, engine).walk_step(away(slip_gait)).following for law in laws]
    assert steps[0] == pytest.approx(steps[1], abs=1e-11)


def test_computed_torque_with_zero_gains_is_inverse_dynamics(compass, slip_gait):
    """It still cancels the robot's own dynamics, so it is the open loop on the plan only: e'' = 0 beside it."""
    motion, k = slip_gait.motion, 30
    segment, p = motion.segments[1], compass.vector(motion.parameters)
    law, clock = zero_gains("computed torque", compass, motion), segment.time[k]
    off, corrections = np.array([0, 0, 0.01, -0.02]), []
    planned = compass.acceleration[segment.mode](segment.q[:, k], segment.v[:, k], segment.torque[:, k], p)[0]
    for size in (0, 1):
        q, v = segment.q[:, k] + size * off, segment.v[:, k] + 3 * size * off
        torque = law.torque_at(clock, q, v)
        found = compass.acceleration[segment.mode](q, v, torque, p)[0]
        assert np.asarray(found).ravel()[2:] == pytest.approx(np.asarray(planned).ravel()[2:], abs=1e-8)
        corrections.append(np.max(np.abs(torque - segment.torque[:, k])))
    assert corrections[0] < 1e-8
    assert corrections[1] > 0.1
