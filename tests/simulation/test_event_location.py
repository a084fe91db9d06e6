"""Events that are easy to miss: at the very start of a mode, within a sample, and short dips of a guard."""

import math

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, compass_biped, passive, rimless_wheel, simulate, solve, verify
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.critical_friction import critical_friction
from gaitopt.stability.return_map import Passage
from gaitopt.study import locate_basin_edges


def test_contact_force_that_pulls_at_the_start_is_lift_off(engine):
    # The wheel's normal force at the start of a step, m (g cos(a) cos(th) ... ) by hand: f_n = m (g cos(alpha)
    # - l (thdd sin th + thd^2 cos th)), thdd = g sin(th + alpha) / (l (1 + kappa)).
    slope, theta, kappa = -0.05, -math.pi / 10, 1 / 3
    turning = 9.8 * math.sin(theta + slope) / (1 + kappa)
    fastest = math.sqrt((9.8 * math.cos(slope) - turning * math.sin(theta)) / math.cos(theta))
    for factor, stop in ((1 - 1e-6, "fell"), (1 + 1e-6, "lift_off")):
        walk = simulate(rimless_wheel(), [0, 0, theta], [0, 0, factor * fastest], {"slope": slope}, engine=engine)
        assert (walk.stop.key == "lift_off") is (stop == "lift_off")
    edges = locate_basin_edges(
        rimless_wheel(), {"slope": slope}, {"theta_rate": np.linspace(2.8, 3.3, 4)}, engine=engine
    )
    assert edges[-1][0] == pytest.approx(fastest, abs=1e-8)


def test_slide_shorter_than_a_sample_is_followed(engine):
    # Just below friction 0.2676 Type B begins with a slide of about a millisecond (Gamus & Or 2015).
    downhill = {"slope": math.radians(13), "friction": 0.267}
    walk = simulate(rimless_wheel(), [0, 0, -math.pi / 10], [0, 0, 2.39], downhill, engine=engine)
    assert str(walk.motion.sequence()) == "slip+ stick slip+ | stick"
    assert walk.motion.segments[0].duration == pytest.approx(1.3e-3, abs=1e-4)


@pytest.mark.parametrize("excess", [1e-2, 1e-4, 1e-6])
def test_short_dip_out_of_the_cone_is_a_slide(engine, excess):
    # The force ratio of this step has its maximum inside it; with a little less friction the foot slides for a moment.
    robot, slope = compass_biped(), math.radians(1.5)
    angle = -0.156081751597208
    q, v = np.array([0, 0, angle, angle]), np.array([0, 0, 1.6614965335222514, 1.9036859990061927])
    p = robot.vector(robot.resolve({"slope": slope}))
    walker = Walker(robot, passive(robot), p, engine)
    state = np.concatenate([q, v])
    needed = critical_friction(walker, Passage(None, (state,), (walker.walk_step(state),)))
    assert 0.1 < needed.time < 0.5
    walk = simulate(robot, q, v, {"slope": slope, "friction": needed.friction * (1 - excess)}, engine=engine)
    assert [segment.mode.slips for segment in walk.motion.segments][:2] == [False, True]


@pytest.mark.slow
def test_a_foot_that_rises_for_two_milliseconds_lands(engine):
    """The swing foot is below the ground until 2 ms before its touchdown: the guard rises to 3e-6 and falls again."""
    values = {"leg_length": 1.80787, "leg_com": 0.844615, "leg_mass": 5.08337, "hip_mass": 3.95648}
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="slip+ stick | slip+",
        parameters=values,
        slope=math.radians(0.482792),
        friction=0.18649,
        speed=0.844533,
        step_length=0.50067,
        limits=Limits(torque=14.3749),
        objective="torque_rate",
        transcription=Collocation(intervals=40),
    )
    gait = solve(problem)
    last = gait.motion.segments[-1]
    guards = [
        float(gait.robot.touchdown(q, v, gait.robot.vector(gait.motion.parameters))[0])
        for q, v in zip(last.q.T, last.v.T, strict=True)
    ]
    assert max(guards[:-1]) < 1e-5
    assert verify(gait, engine=engine).verification.passed
