"""Laws by the stance angle: what they read off the plan, and how steps under them change with their start."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    InputError,
    Law,
    ScipyEngine,
    by_stance_angle,
    feedforward,
    joint_pd,
    step_lqr,
    step_to_step,
)
from gaitopt.control.signature import control_function, law_inputs
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.linearisation import Linearisation


def torque(law, clock, q, v):
    return law.torque_at(clock, q, v)


@pytest.mark.parametrize("late", [0.0, 0.4])
def test_it_reads_the_plan_off_the_angle_whatever_the_clock(compass, slip_gait, late):
    law = by_stance_angle(compass, slip_gait.motion, joint_pd(compass, slip_gait.motion, stiffness=100, damping=10))
    for segment in slip_gait.motion.segments:
        for k in range(0, segment.time.size, 6):
            q, v = segment.q[:, k], segment.v[:, k]
            assert torque(law, segment.time[k] + late, q, v) == pytest.approx(segment.torque[:, k], abs=1e-6)


def test_it_is_the_law_by_the_clock_at_the_planned_time_of_the_angle(compass, slip_gait):
    motion, segment = slip_gait.motion, slip_gait.motion.segments[1]
    plain = joint_pd(compass, motion, stiffness=30, damping=4, torque_limit=6)
    law, off = by_stance_angle(compass, motion, plain), np.array([0, 0, 0, 0.02])
    for k in (3, 30, 60):
        q, v = segment.q[:, k] + off, segment.v[:, k] - 2 * off
        assert torque(law, 9.9, q, v) == pytest.approx(torque(plain, segment.time[k], q, v), abs=1e-6)
    assert law.gain_values == plain.gain_values
    assert law.with_gains({"hip_damping": 7}).gain_values["hip_damping"] == 7


def test_the_ends_are_held_beyond_the_planned_angles(compass, slip_gait):
    motion, first, last = slip_gait.motion, slip_gait.motion.segments[0], slip_gait.motion.segments[-1]
    law = by_stance_angle(compass, motion, feedforward(compass, motion))
    for q, planned in ((first.q[:, 0], first.torque[:, 0]), (last.q[:, -1], last.torque[:, -1])):
        away = np.array([0, 0, 0.2 * np.sign(q[2]), 0])
        for beyond in (away, 5 * away):
            assert torque(law, 0.0, q + beyond, first.v[:, 0]) == pytest.approx(planned, abs=1e-12)


def test_pieces_that_begin_together_but_for_rounding_are_one(compass, slip_gait):
    plain = feedforward(compass, slip_gait.motion)
    law = by_stance_angle(compass, slip_gait.motion, plain.split(plain.breakpoints[3:6] + 1e-15))
    assert law.breakpoints.size == by_stance_angle(compass, slip_gait.motion, plain).breakpoints.size
    assert np.all(np.isfinite(law.table))


def test_latched_values_stay(compass, slip_gait):
    plain = step_lqr(compass, slip_gait.motion, torque_limit=8)
    law, first = by_stance_angle(compass, slip_gait.motion, plain), slip_gait.motion.segments[0]
    q, v = first.q[:, 0], first.v[:, 0] + np.array([0, 0, 0.02, -0.01])
    values = [np.asarray(each.memory.latch(q, v, each.table[:, 0])).ravel() for each in (plain, law)]
    assert np.max(np.abs(values[0])) > 0.01
    assert values[0] == pytest.approx(values[1], abs=1e-14)


@pytest.mark.parametrize("engine", [default_engine(), ScipyEngine()], ids=lambda engine: engine.name)
def test_torques_that_jump_at_an_angle_have_their_saltation(compass, engine):
    """The ankle pushes with 2 N m between two angles: the instant of the jumps depends on the start."""
    inputs = law_inputs(compass, data=3)
    data, left = inputs.data, ca.vertcat(inputs.q[2] - inputs.data[0], inputs.data[1] - inputs.q[2])
    function = control_function(inputs, ca.vertcat(data[2], 0), bounds=left)
    bounds = np.array([-1e3, -0.05, 0.06, 1e3])
    law = Law("push", function, bounds[:-1], np.vstack([bounds[:-1], bounds[1:], [0.0, 2.0, 0.0]]), index=2)
    p = compass.vector(compass.resolve({"slope": 0.0, "friction": 0.5}))
    walker = Walker(compass, law, p, engine)
    start = np.array([0, 0, -0.15, -0.15, 0, 0, 0.8, -0.5])
    walk_step, columns, places = walker.walk_step(start), [], [2, 3, 6, 7]
    exact = Linearisation(walker).derivative(start, walk_step)
    for j in places:
        shift = 1e-6 * np.eye(8)[j]
        ends = [walker.walk_step(start + sign * shift).following for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / 2e-6)
    assert np.array(columns).T[places] == pytest.approx(exact[np.ix_(places, places)], abs=1e-6)
    jumps = np.diff(
        [walker.torque(walk_step.modes[0], 0, np.array([0, 0, th, 0, 0, 0, 1, 0]))[0] for th in (-0.06, 0, 0.07)]
    )
    assert jumps.tolist() == [2.0, -2.0]


def test_mistakes_are_explained(compass, slip_gait):
    motion = slip_gait.motion
    law = feedforward(compass, motion)
    with pytest.raises(
        InputError, match=r"planned angle 'th2' does not increase throughout the step: at 0\.\d+ s its rate"
    ):
        by_stance_angle(compass, motion, law, angle="th2")
    with pytest.raises(InputError, match="no angle 'knee'"):
        by_stance_angle(compass, motion, law, angle="knee")
    indexed = by_stance_angle(compass, motion, law)
    with pytest.raises(InputError, match="has a phase variable already; by_stance_angle needs a law of the time"):
        by_stance_angle(compass, motion, indexed)
    with pytest.raises(InputError, match="has a phase variable; add them to the law of the time"):
        step_to_step(compass, indexed, np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)
    limited = joint_pd(compass, motion, stiffness=0, damping=0, torque_limit=8)
    with pytest.raises(InputError, match="has torque limits; omit them, and limit the sum by"):
        step_to_step(compass, limited, np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)
    latching = step_to_step(compass, law, np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)
    with pytest.raises(InputError, match="has latched values; use a law without them"):
        step_to_step(compass, latching, np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)


def test_a_stance_leg_that_all_but_rests_is_refused(compass, slip_gait):
    segment = slip_gait.motion.segments[1]
    k = segment.time.size // 2
    v = segment.v.copy()
    v[2, k] = 1e-7
    slow = dataclasses.replace(slip_gait.motion, segments=(dataclasses.replace(segment, v=v, time=segment.time),))
    with pytest.raises(InputError, match=r"nearly at rest at 0\.\d+ s"):
        by_stance_angle(compass, slow, feedforward(compass, slow))
