"""Torques that meet their limits: both engines, and derivatives against finite differences."""

import numpy as np
import pytest

from gaitopt import ScipyEngine, compass_biped, joint_pd, load
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

HeyokaEngine = pytest.importorskip("gaitopt.simulation.taylor.heyoka_engine").HeyokaEngine
pytest.importorskip("heyoka")


@pytest.fixture(scope="module")
def setting():
    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    law = joint_pd(robot, gait.motion, stiffness=100, damping=5, torque_limit=6)
    p = robot.vector(gait.motion.parameters)
    first, section = gait.motion.segments[0], Section(robot, p, sliding=True)
    z = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    return robot, law, p, section, z


@pytest.mark.parametrize("push", [(0.01, -0.1, -0.2, 0), (-0.01, -0.05, 0.2, 0), (0, 0, -0.3, 0.05)])
def test_engines_agree_on_a_saturated_step_and_its_derivative(setting, push):
    robot, law, p, section, z = setting
    ends, slopes, works = [], [], []
    for engine in (HeyokaEngine(), ScipyEngine()):
        walker = Walker(robot, law, p, engine)
        returning = ReturnMap(walker, section)
        passage = returning(z + push)
        ends.append(passage.end)
        slopes.append(returning.derivative(z + push, passage))
        walk = record_walk(walker, section.embed(z + push), 1).motion
        works.append(np.concatenate([segment.work[:, -1] for segment in walk.segments]))
        torque = walk.channel("torque")
        assert np.max(np.abs(torque)) <= 6 + 1e-12
        assert np.max(np.abs(torque)) == pytest.approx(6)
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert slopes[0] == pytest.approx(slopes[1], abs=1e-7)
    assert works[0] == pytest.approx(works[1], abs=1e-8)


def test_derivative_of_a_saturated_step_agrees_with_finite_differences(setting):
    robot, law, p, section, z = setting
    returning, z = ReturnMap(Walker(robot, law, p, HeyokaEngine()), section), z + np.array([-0.01, -0.05, 0.2, 0])
    exact, step, columns = returning.derivative(z, returning(z)), 2e-7, []
    for unit in np.eye(4):
        one, two = (returning(z + k * step * unit).end - returning(z - k * step * unit).end for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    assert np.max(np.abs(np.array(columns).T - exact)) < 1e-5 * np.max(np.abs(exact))


def test_limits_never_met_change_nothing(setting):
    robot, law, p, section, z = setting
    law = law.with_gains(dict.fromkeys(law.gains, 1.0))
    free = joint_pd(robot, load("docs/examples/compass_slip.h5").motion, stiffness=1, damping=1)
    ends = [ReturnMap(Walker(robot, each, p, HeyokaEngine()), section)(z).end for each in (law, free)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-13)
