"""Recovery from seeded pushes."""

import dataclasses
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from gaitopt import InputError, PushTest, assess_stability, compass_biped, feedforward, load
from gaitopt.simulation import StepLimits, default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability import recovery
from gaitopt.stability.recovery import draw_from_ball, find_largest_recovery, measure_recovery
from gaitopt.stability.unreturned_walk import classify_unreturned_walk
from gaitopt.status import Stop

TEST = PushTest(starts=12, steps=30, resolution=0.2)


@pytest.fixture(scope="module")
def open_loop():
    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    law = feedforward(robot, gait.motion)
    p, limits = robot.vector(gait.motion.parameters), StepLimits(duration=3)
    walker = Walker(robot, law, p, default_engine(law), step_limits=limits)
    return walker, assess_stability(gait, law)


def test_small_pushes_are_recovered_from_at_the_rate_of_the_multipliers(open_loop):
    walker, cycle = open_loop
    found = measure_recovery(walker, cycle, 5e-4, TEST)
    assert found.complete
    # A deviation of at most 1e-3 falls below 1e-4 in about log(0.1) / log(radius) steps, more for oblique ones.
    assert max(found.settling) <= np.log(0.1) / np.log(cycle.radius) + 10


@pytest.mark.slow
def test_the_largest_radius_is_where_returning_ends(open_loop):
    walker, cycle = open_loop
    found = find_largest_recovery(walker, cycle, TEST)
    assert found.complete
    assert measure_recovery(walker, cycle, found.radius, TEST).complete
    assert found.radius < found.beyond <= 1.3 * found.radius
    assert not measure_recovery(walker, cycle, found.beyond, TEST).complete


def test_pushes_are_seeded(open_loop):
    walker, cycle = open_loop
    one, two = (measure_recovery(walker, cycle, 1e-3, TEST).settling for _ in range(2))
    assert one == two
    other = measure_recovery(walker, cycle, 1e-3, attrs.evolve(TEST, seed=1))
    assert other.settling != one


def test_an_unstable_gait_is_returned_to_from_nowhere(open_loop):
    walker, cycle = open_loop
    unstable = dataclasses.replace(cycle, multipliers=2 * np.ones(4, complex))
    assert find_largest_recovery(walker, unstable, TEST).radius == 0


def test_mistakes_are_explained():
    with pytest.raises(InputError, match=r"PushTest.starts must be at least 1, got 0"):
        PushTest(starts=0)
    with pytest.raises(InputError, match=r"PushTest.seed must be at least 0, got -1"):
        PushTest(seed=-1)
    with pytest.raises(InputError, match=r"PushTest.largest must be greater than 0 \[rad/s\]"):
        PushTest(largest=-1)


@pytest.mark.parametrize("resolution", [0.05, 0.5])
@pytest.mark.parametrize("edge", [0.03, 0.3, 1.5, 1.99, 5.0])
def test_the_search_ends_wherever_the_edge_is(monkeypatch, open_loop, edge, resolution):
    """The walks are replaced by the statement that those from pushes below an edge return."""
    test, calls = PushTest(starts=5, resolution=resolution), []
    size = max(abs(push[0]) for push in recovery.draw_from_ball(np.eye(1), test))

    def count(walk, push, test):
        calls.append(push)
        assert len(calls) < 200, "the search does not end"
        return 1 if abs(push[0]) < edge * size else None

    monkeypatch.setattr(recovery, "make_pushed_walk", lambda walker, cycle: SimpleNamespace(spread=np.eye(1)))
    monkeypatch.setattr(recovery, "_count_settling_steps", count)
    found = find_largest_recovery(*open_loop, test)
    if edge > test.largest:
        assert (found.radius, found.beyond) == (test.largest, np.inf)
    else:
        assert found.radius < edge <= found.beyond <= found.radius / (1 - resolution)


@pytest.mark.parametrize("edge", [0.13, 0.3, 1.5, 5.0])
def test_the_stated_number_of_walks_is_not_exceeded_if_the_first_ball_returns(monkeypatch, open_loop, edge):
    test, walks = PushTest(starts=5), []

    def count(walk, push, test):
        walks.append(push)
        return 1 if abs(push[0]) < edge else None

    monkeypatch.setattr(recovery, "make_pushed_walk", lambda walker, cycle: SimpleNamespace(spread=np.eye(1)))
    monkeypatch.setattr(recovery, "_count_settling_steps", count)
    find_largest_recovery(*open_loop, test)
    assert test.most_walks / 4 < len(walks) <= test.most_walks


def test_the_number_of_walks_follows_from_starts_and_resolution():
    assert PushTest().most_walks == 2000
    assert PushTest(starts=3, resolution=0.5).most_walks == 18
    assert PushTest(starts=1, resolution=1.0).most_walks == 5


@pytest.mark.parametrize(
    ("factor", "limit", "failure"),
    [(0.95, 1.0, "slow"), (-0.95, 1.0, "slow"), (1.0, 1.0, "left"), (1.05, 9.0, "left"), (1.05, 1.1, "ended")],
)
def test_walks_that_end_leave_or_need_more_steps_are_distinguished(factor, limit, failure):
    """The return map is linear, and a walk ends where the deviation exceeds a limit."""

    def take_step(state):
        return factor * state if abs(state) <= limit else None

    walk = SimpleNamespace(begin=lambda push: push[0], take_step=take_step, distance=abs)
    walk.find_stop = lambda state: Stop.FELL if abs(state) > limit else None
    expected = failure, Stop.FELL if failure == "ended" else None
    assert classify_unreturned_walk(walk, np.array([0.5]), 30) == expected


@pytest.mark.slow
def test_a_walk_that_needs_more_steps_returns_within_them(open_loop):
    few = attrs.evolve(TEST, steps=3)
    found = find_largest_recovery(*open_loop, few)
    assert found.radius < recovery.NEGLIGIBLE_PUSH
    assert found.failure == "slow"
    assert 0 < found.failures["slow"] <= TEST.starts
    assert set(found.failures) == {"slow"}
    assert measure_recovery(*open_loop, found.beyond, TEST).complete
    assert find_largest_recovery(*open_loop, TEST).failure == ""


def test_all_walks_of_the_smallest_ball_without_recovery_are_classified(open_loop, monkeypatch):
    """After small pushes the walk returns in one step, after larger ones it
    approaches the gait too slowly, and the largest ones end it."""
    slow, end = 3.2e-4, 4e-4

    def take_step(state):
        return None if abs(state) > end else 0.0 if abs(state) <= 0.99 * slow else 0.999 * state

    walk = SimpleNamespace(spread=np.eye(1), begin=lambda push: push[0], take_step=take_step, distance=abs)
    walk.find_stop = lambda state: Stop.LIFT_OFF if abs(state) > end else None
    monkeypatch.setattr(recovery, "make_pushed_walk", lambda walker, cycle: walk)
    test = attrs.evolve(TEST, starts=40, steps=5, largest=0.01, resolution=0.9, tolerance=1e-9)
    found = find_largest_recovery(*open_loop, test)
    sizes = [abs(found.beyond * push[0]) for push in draw_from_ball(np.eye(1), test)]
    ended, slowed = sum(size > end for size in sizes), sum(slow < size <= end for size in sizes)
    assert min(ended, slowed) > 1
    assert found.failures == {"ended": ended, "slow": slowed}
    assert found.ends == {"lift_off": ended}
    assert found.failure == "ended"
