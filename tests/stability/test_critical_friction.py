"""The friction a sticking gait needs: the largest force ratio, found on one integration per step."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from gaitopt import Mode, ScipyEngine, find_cycles, joint_pd, load, passive, replay, rimless_wheel
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability import assess_planar
from gaitopt.stability import cycle as cycle_module
from gaitopt.stability.critical_friction import critical_friction
from gaitopt.stability.return_map import Passage
from gaitopt.study.planar_metrics import largest_foot_ratio
from tests.conftest import ROOT
from tests.stability.conftest import COMPASS


class CountingEngine:
    """The reference engine, which adds up how long its integrations are."""

    name = "counting"

    def __init__(self):
        self.seconds, self._engine = 0.0, ScipyEngine()

    def flow(self, loop, mode, clock, state, *, until, record=False):
        arc = self._engine.flow(loop, mode, clock, state, until=until, record=record)
        self.seconds += arc.time[-1] - clock
        return arc


@pytest.fixture(params=["passive", "controlled"])
def step(request, compass, cycle, slip_gait):
    """Return a walker with unlimited friction and a step of it, that of a passive gait or of a law."""
    gait = cycle(compass, {**COMPASS, "friction": 0.3}, [-0.1478, 0.7328, -0.5007, 0])
    law, state = passive(compass), gait.section.embed(gait.z)
    parameters = gait.parameters
    if request.param == "controlled":  # the ratio is largest in the middle of the step
        law = joint_pd(compass, replay(slip_gait).motion, stiffness=5)
        first, parameters = slip_gait.motion.segments[0], slip_gait.motion.parameters
        state = np.concatenate([first.q[:, 0], [0.0, 0.0], first.v[2:, 0]])
    p = compass.vector({**parameters, "friction": math.inf})
    walker = Walker(compass, law, p, CountingEngine())
    walk_step = walker.walk_step(state)
    assert walk_step.modes == (Mode.STICK,)
    walker.engine.seconds = 0.0
    return walker, Passage(None, (state,), (walk_step,))


def test_each_step_is_integrated_about_once(step):
    """It once was integrated from its start to each of sixty instants."""
    walker, passage = step
    critical_friction(walker, passage)
    assert walker.engine.seconds < 2 * passage.walk_steps[0].duration


@pytest.mark.slow
def test_no_sample_of_the_step_needs_more(step):
    walker, passage = step
    found = critical_friction(walker, passage)
    robot, n = walker.robot, walker.robot.n_q
    arc = ScipyEngine(samples=40).flow(
        walker.loop, Mode.STICK, 0.0, passage.states[0], until=passage.walk_steps[0].duration, record=True
    )
    ratios = []
    for t, y in zip(arc.time, arc.states.T, strict=True):
        force = np.asarray(robot.acceleration[Mode.STICK](y[:n], y[n:], walker.torque(Mode.STICK, t, y), walker.p)[1])
        ratios.append(abs(force[0, 0]) / force[1, 0])
    assert max(ratios) <= found.friction + 1e-12
    assert max(ratios) == pytest.approx(found.friction, rel=1e-4)
    k = int(np.argmax(ratios))
    assert found.time == pytest.approx(arc.time[k], abs=2e-2)


@pytest.mark.parametrize("value", [np.nan, -1.0])
def test_a_force_that_is_nan_or_pulls_needs_infinite_friction(step, value):
    walker, passage = step
    force = walker.robot.acceleration[Mode.STICK]
    inputs = force.sx_in()
    broken = ca.Function("broken", inputs, [force(*inputs)[0], ca.vertcat(1, value)])
    robot = dataclasses.replace(walker.robot, acceleration={**walker.robot.acceleration, Mode.STICK: broken})
    walker.robot, walker.engine = robot, _Sampled(passage)
    assert critical_friction(walker, passage).friction == math.inf


class _Sampled:
    """An engine that returns the ends of a step."""

    def __init__(self, passage):
        self.arc = passage.walk_steps[0].arcs[0][1]

    def flow(self, *_, **__):
        return self.arc


def test_an_impulse_that_is_nan_needs_infinite_friction(step):
    walker, passage = step
    walk_step = passage.walk_steps[0]
    impact = walk_step.impact._replace(impulse=walk_step.impact.impulse * np.nan)
    broken = Passage(None, passage.states, (walk_step._replace(impact=impact),))
    assert critical_friction(walker, broken).impact == math.inf


def test_the_critical_friction_of_a_gait_is_evaluated_when_it_is_read(monkeypatch):
    evaluated = []
    monkeypatch.setattr(cycle_module, "critical_friction", lambda walker, passage: evaluated.append(passage))
    (gait,) = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=5)
    assert not evaluated
    assert gait.critical_friction is gait.critical_friction is None
    assert len(evaluated) == 1


@pytest.mark.slow
def test_the_vanishing_forces_at_a_lift_off_are_left_out():
    """Both forces of the foot that opens vanish there; the samples of the plan are an independent bound."""
    gait = load(ROOT / "tests" / "problems" / "bounding_quadruped.h5")
    critical = assess_planar(gait).critical_friction
    largest = largest_foot_ratio(gait)
    assert largest <= critical.friction <= 1.01 * largest
    assert critical.friction < gait.motion.parameters["friction"]
