"""Walks of robots with several contacts after a push, and their disturbances."""

import numpy as np
import pytest

from gaitopt import Collocation, PushTest
from gaitopt.control import planar_feedforward, planar_joint_pd
from gaitopt.control.law import passive
from gaitopt.errors import InputError
from gaitopt.model import compass_biped
from gaitopt.ocp import solve_planar
from gaitopt.simulation.planar_simulation import planar_delay
from gaitopt.simulation.planar_simulation.planar_delay import DelayedPlanarWalker
from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
from gaitopt.stability import assess_planar, assess_stability, find_largest_recovery, measure_recovery
from gaitopt.stability.gait_recovery import measure_gait_recovery
from gaitopt.stability.planar_gaits.planar_pushed_walk import PlanarPushedWalk, compute_push_weights
from gaitopt.stability.planar_gaits.planar_section import section_of
from gaitopt.stability.planar_gaits.state_change import change_state
from gaitopt.stability.recovery import draw_from_ball
from gaitopt.status import Stop
from gaitopt.study import WalkTest, assess_robustness
from gaitopt.study.robustness.disturbed_gait import PlanarDisturbedGait
from tests.ocp.multicontact_examples import walk


@pytest.fixture(scope="module")
def gait():
    return solve_planar(walk(transcription=Collocation(intervals=10)))


@pytest.fixture(scope="module")
def law(gait):
    return planar_joint_pd(gait, stiffness=8.0, damping=2.0)


@pytest.fixture(scope="module")
def cycle(gait, law):
    return assess_stability(gait, law)


@pytest.fixture
def walker(gait, law, cycle):
    return PlanarWalker(gait.robot, law, cycle.parameters, section=cycle.section, period=cycle.period)


def test_one_function_assesses_the_gaits_of_all_robots(gait, law, cycle):
    assert cycle.radius == assess_planar(gait, law).radius < 1
    with pytest.raises(InputError, match="several contacts needs a PlanarLaw, got the Law 'passive'"):
        assess_stability(gait, passive(compass_biped()))


def test_a_step_returns_to_the_gait_with_exchanged_legs(walker, cycle):
    walk_step = walker.walk_step(cycle.start)
    assert walk_step.stop is None
    assert walk_step.following.contacts == cycle.start.contacts
    moved = np.abs(walk_step.following.y - cycle.start.y)[[name != "x" for name in cycle.state]]
    assert np.max(moved) < 1e-7


def test_a_push_has_its_size_and_moves_no_foot_off_the_ground(walker, cycle):
    pushed, weights = PlanarPushedWalk(walker, cycle), compute_push_weights(walker, cycle)
    # w = sqrt(g / l): coordinates x, y, a, b; the hip of the compass is its highest point
    height = cycle.state["y"]
    root = np.sqrt(cycle.parameters["gravity"] / height)
    expected = [root / height, root / height, root, root, 1 / height, 1 / height, 1, 1]
    assert weights == pytest.approx(expected)
    for push in draw_from_ball(pushed.spread, PushTest(starts=3)):
        size = np.linalg.norm(weights * push)
        assert 0 < size <= 1
        section = section_of(walker.automaton, walker.walk_step(cycle.start).rollout)
        assert np.max(np.abs(section.violation(pushed.begin(0.05 * push).y))) < 1e-12


def test_walks_return_from_small_pushes_only(walker, cycle, gait, law):
    test = PushTest(starts=2, steps=20)
    near, far = (measure_recovery(walker, cycle, radius, test) for radius in (1e-3, 3.0))
    assert near.complete
    assert not far.complete
    assert measure_gait_recovery(gait, law, 1e-3, test) == near


@pytest.mark.slow
def test_the_largest_ball_of_recovered_pushes_is_bracketed(walker, cycle):
    test = PushTest(starts=2, resolution=0.3)
    found = find_largest_recovery(walker, cycle, test)
    assert 0.01 < found.radius < found.beyond <= found.radius / 0.7
    assert measure_recovery(walker, cycle, found.radius, test).complete
    assert not measure_recovery(walker, cycle, found.beyond, test).complete


def test_a_push_test_refuses_a_gait_of_another_kind(walker, cycle, gait):
    with pytest.raises(InputError, match="a PlanarWalker with a PlanarCycle"):
        measure_recovery(walker, walker, 0.1)
    with pytest.raises(InputError, match="The law 'passive' does not belong to the gait of robot"):
        measure_gait_recovery(gait, passive(compass_biped()), 0.1)
    with pytest.raises(InputError, match="a PlanarRobot, a PlanarLaw and a PlanarCycle"):
        assess_robustness(compass_biped(), passive(compass_biped()), cycle)


def test_a_changed_state_keeps_its_feet_on_the_ground(walker, cycle):
    section = section_of(walker.automaton, walker.walk_step(cycle.start).rollout)
    y = change_state(section, cycle.start.y, {"a_rate": cycle.state["a_rate"] - 0.1})
    changed = dict(zip(cycle.state, y - cycle.start.y, strict=True))
    assert changed["a_rate"] == pytest.approx(-0.1, abs=1e-12)
    assert [changed[name] for name in ("x", "y", "a", "b", "b_rate")] == pytest.approx([0] * 5, abs=1e-12)
    assert abs(changed["x_rate"]) > 0.1
    assert np.max(np.abs(section.violation(y))) < 1e-12
    assert change_state(section, cycle.start.y, {"a": 0.3, "b": 0.1, "y": 1.0}) is None


def test_the_effect_of_a_delay_is_proportional_to_it(gait, law, cycle, walker):
    expected, errors = walker.walk_step(cycle.start).following.y, []
    for delay in (0.02, 0.01):
        late = DelayedPlanarWalker(
            gait.robot, law, cycle.parameters, section=cycle.section, period=cycle.period, delay=delay
        )
        errors.append(np.max(np.abs(late.walk_step(cycle.start).following.y - expected)))
    assert errors[1] > 1e-4
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.2)


def test_a_delayed_step_ends_after_as_many_events_as_any_other(monkeypatch):
    """The slip, the rest and the touchdown of a step belong to different readings."""
    gait = solve_planar(walk("slip+ stick | slip+", friction=0.14, transcription=Collocation(intervals=(6, 10))))
    law = planar_feedforward(gait)
    cycle = assess_planar(gait, law)
    options = {"section": cycle.section, "period": cycle.period, "delay": cycle.period / 20}
    assert DelayedPlanarWalker(gait.robot, law, cycle.parameters, **options).walk_step(cycle.start).stop is None
    monkeypatch.setattr(planar_delay, "MOST_EVENTS", 1, raising=False)
    walker = DelayedPlanarWalker(gait.robot, law, cycle.parameters, **options)
    assert walker.walk_step(cycle.start).stop is Stop.TOO_MANY_EVENTS


def test_noise_acts_on_the_actuators_of_the_gait(gait, law, cycle, walker):
    disturbed = PlanarDisturbedGait(gait.robot, law, cycle)
    assert disturbed.noise_range.unit == "N m"
    expected = walker.walk_step(cycle.start).following.y
    silent, noisy, again = (
        disturbed.noisy_walker(size, np.random.default_rng(0)).walk_step(cycle.start).following.y
        for size in (0, 0.1, 0.1)
    )
    assert silent == pytest.approx(expected, abs=1e-7)
    assert noisy == pytest.approx(again, abs=0)
    assert np.max(np.abs(noisy - expected)) > 1e-4
    ankle = gait.robot.actuators.index("ankle B")  # idle in the plan
    noisy_torque = disturbed.noisy_walker(5.0, np.random.default_rng(0)).walk_step(cycle.start).rollout.motion
    assert not np.any(noisy_torque.channel("torque")[ankle])


@pytest.mark.slow
def test_every_kind_of_disturbance_is_survived_up_to_a_limit(gait, law, cycle):
    walking = WalkTest(steps=6, patch=2, resolution=0.3)
    margins = assess_robustness(gait.robot, law, cycle, walking=walking, test=PushTest(starts=1, resolution=0.5))
    kinds = ["push", "downhill slope", "uphill slope", "friction patch", "torque noise", "sensor delay"]
    assert [each.kind for each in margins] == kinds
    assert all(each.survived > 0 for each in margins)
    assert margins[2].failed is not None
