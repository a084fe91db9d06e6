"""Laws that latch values over a step and read the sign of the slide: derivatives and engines."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Law, ScipyEngine, compass_biped, load
from gaitopt.control.reference import reference
from gaitopt.control.signature import control_function, law_inputs, make_memory
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


@pytest.fixture(scope="module")
def setting():
    """A law whose hip torque is corrected by a value latched at touchdown and whose ankle brakes a slide."""
    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    plan = reference(robot, gait.motion)
    inputs = law_inputs(robot, data=plan.size + 1, latched=1)
    clock, q, v, latched, slide, data = inputs
    torque = plan.evaluate(clock, data).torque + ca.vertcat(-20 * slide * v[0], latched)
    kept = make_memory(inputs, data[-1] * (v[2] - 0.59 + v[0] * q[2]), values=["hip torque"])
    table = np.vstack([plan.table, np.full(plan.breakpoints.size, 1.5)])
    law = Law("latching", control_function(inputs, torque), plan.breakpoints, table, {"push": plan.size}, kept)
    p = robot.vector(gait.motion.parameters)
    z = Section(robot, p, sliding=True).project(
        np.concatenate([gait.motion.segments[0].q[:, 0], gait.motion.segments[0].v[:, 0]])
    )
    return robot, law, p, z


def returning(setting, engine):
    robot, law, p, _ = setting
    return ReturnMap(Walker(robot, law, p, engine), Section(robot, p, sliding=True))


def test_derivative_includes_latched_values(setting):
    found, z = returning(setting, ScipyEngine()), setting[-1]
    exact, step = found.derivative(z, found(z)), 2e-7
    columns = []
    for unit in np.eye(4):
        one, two = (found(z + k * step * unit).end - found(z - k * step * unit).end for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    assert np.max(np.abs(np.array(columns).T - exact)) < 1e-5 * np.max(np.abs(exact))


def test_latched_values_matter(setting):
    robot, law, p, z = setting
    without = ReturnMap(Walker(robot, law.with_gains({"push": 0.0}), p, ScipyEngine()), Section(robot, p, sliding=True))
    found = returning(setting, ScipyEngine())
    assert not np.allclose(found.derivative(z, found(z)), without.derivative(z, without(z)), atol=1e-2)


@pytest.mark.slow
def test_both_engines_agree(setting):
    z = setting[-1] + np.array([0, 0.01, 0, 0])
    ends, slopes = [], []
    for engine in (ScipyEngine(), default_engine()):
        found = returning(setting, engine)
        passage = found(z)
        ends.append(passage.end)
        slopes.append(found.derivative(z, passage))
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)
    assert slopes[0] == pytest.approx(slopes[1], abs=1e-8)
