"""Imitation of passive gaits on level ground."""

import math

import numpy as np
import pytest

from gaitopt import InputError, Mode, ScipyEngine, assess_stability, compass_biped, find_cycles, joint_pd, passive
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.study import imitate
from gaitopt.study.imitation import thin_samples


@pytest.fixture(scope="module")
def gait_a():
    return find_cycles(
        compass_biped(), {"slope": math.radians(1), "friction": 0.3}, sequence="stick | stick", starts=30
    )[0]


def test_same_ground_needs_no_torque(gait_a):
    same = imitate(compass_biped(), gait_a, {})
    assert same.feasible
    assert same.largest_torque < 1e-6
    assert str(same.sequence) == gait_a.sequence


def test_uneven_samples_of_an_integrator_are_thinned_without_wide_gaps(gait_a):
    """Between samples 1.65 intervals apart, interpolated accelerations need torques above 1e-6 N m."""
    walker = make_walker(compass_biped(), passive(compass_biped()), gait_a.parameters, engine=ScipyEngine())
    motion = record_walk(walker, gait_a.section.embed(gait_a.z), 1).motion
    time = thin_samples(motion, 80).segments[0].time
    assert time.size < 0.95 * motion.segments[0].time.size
    assert np.diff(time).max() < 1.5 * motion.period / 80


def test_level_ground_needs_what_the_slope_gave(gait_a):
    level = imitate(compass_biped(), gait_a, {"slope": 0.0})
    motion = level.motion
    assert level.feasible
    assert level.gap < 1e-9  # the angles repeat: the impact does not know the slope
    assert motion.period == pytest.approx(gait_a.period, abs=1e-9)
    assert motion.travel == pytest.approx(gait_a.travel, abs=1e-9)
    # Nothing but the actuators makes up for the impact now.
    lost = motion.jumps[0].energy_lost
    assert sum(segment.work[:, -1].sum() for segment in motion.segments) == pytest.approx(lost, rel=1e-6)
    assert level.cost_of_transport >= lost / (motion.total_mass * 9.8 * motion.travel) - 1e-9


def test_torques_by_another_way(gait_a):
    # The equations of motion on level ground, with the passive gait's accelerations on the slope.
    robot = compass_biped()
    level = imitate(robot, gait_a, {"slope": 0.0})
    segment, downhill = level.motion.segments[0], robot.vector(gait_a.parameters)
    flat = robot.vector(level.motion.parameters)
    for k in (0, 100, 300, -1):
        q, v = segment.q[:, k], segment.v[:, k]

        a, _ = robot.acceleration[Mode.STICK](q, v, np.zeros(2), downhill)
        mass, bias, actuation = (np.asarray(part) for part in robot.dynamics(q, v, flat))
        torque = np.linalg.solve(actuation[2:], (mass @ np.asarray(a) + bias)[2:]).ravel()
        assert segment.torque[:, k] == pytest.approx(torque, abs=1e-6)


def test_the_controlled_walker_has_a_gait_near_it(gait_a):
    robot = compass_biped()
    level = imitate(robot, gait_a, {"slope": 0.0})
    plan = level.gait(samples=40)
    held = assess_stability(plan, joint_pd(robot, plan.motion, stiffness=20, damping=5, torque_limit=6))
    assert held.sequence == "stick | stick"
    assert held.z == pytest.approx(gait_a.z[:3], abs=1e-3)
    assert held.stable


def test_what_cannot_be_walked_says_why(gait_a):
    slippery = imitate(compass_biped(), gait_a, {"slope": 0.0, "friction": 0.05})
    assert not slippery.feasible
    with pytest.raises(InputError, match="is not feasible"):
        slippery.gait()
