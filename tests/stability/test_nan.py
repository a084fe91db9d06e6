"""A multiplier, state or residual that is nan makes a gait unstable, a walk lost and a fixed point none."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import Mode, PushTest, ScipyEngine, passive
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.fixed_point import find_fixed_point
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.recovery import measure_recovery
from gaitopt.stability.return_map import Passage
from tests.stability.conftest import WHEEL


@pytest.fixture
def wheel_gait(cycle, wheel):
    return cycle(wheel, {**WHEEL, "friction": 1.0}, [2.4, 0])


def walker_of(robot, cycle):
    return Walker(robot, passive(robot), robot.vector(cycle.parameters), ScipyEngine())


@pytest.mark.parametrize("nan_first", [True, False])
def test_a_multiplier_that_is_nan_is_unstable(wheel_gait, nan_first):
    assert wheel_gait.stable
    sides = [np.full((1, 1), np.nan), np.full((1, 1), 0.5)]
    broken = replace(wheel_gait, one_sided=tuple(sides if nan_first else sides[::-1]))
    assert broken.radius == math.inf
    assert not broken.stable
    assert not replace(wheel_gait, multipliers=wheel_gait.multipliers * np.nan).stable


def test_a_walk_whose_state_is_nan_has_not_returned(wheel_gait, wheel, monkeypatch):
    """It once counted as returned after one step."""
    walker, test = walker_of(wheel, wheel_gait), PushTest(starts=2, steps=3)
    assert measure_recovery(walker, wheel_gait, 0.01, PushTest(starts=2, tolerance=0.1)).complete
    lost = SimpleNamespace(following=np.full(2 * wheel.n_q, np.nan))
    monkeypatch.setattr(walker, "walk_step", lambda state: lost)
    assert measure_recovery(walker, wheel_gait, 0.01, test).returned == 0


@pytest.mark.parametrize("what", ["end", "derivative"])
def test_a_return_map_that_is_nan_has_no_fixed_point(what):
    class Returning:
        def __call__(self, z):
            return Passage(z * (np.nan if what == "end" else 1.0), (), ())

        def derivative(self, z, passage):
            return np.full((1, 1), np.nan if what == "derivative" else 0.5)

    assert find_fixed_point(Returning(), np.array([1.0])) is None


@pytest.mark.parametrize("mode", ["stick", "slip"])
def test_an_impact_that_is_nan_is_not_near_an_edge(wheel_gait, wheel, mode):
    walker = Walker(wheel, passive(wheel), wheel.vector({**wheel_gait.parameters, "friction": 0.3}), ScipyEngine())
    state = wheel_gait.section.embed(wheel_gait.z)
    walk_step = walker.walk_step(state)
    impact = walk_step.impact._replace(
        mode=Mode.STICK if mode == "stick" else Mode.SLIP_FORWARD,
        impulse=walk_step.impact.impulse * np.nan,
        v_plus=walk_step.impact.v_plus * np.nan,
    )
    assert one_sided_derivatives(walker, state, walk_step._replace(impact=impact)) == ()
