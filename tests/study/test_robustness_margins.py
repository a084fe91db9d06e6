"""Disturbances of controlled gaits."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from gaitopt import (
    Execution,
    InputError,
    PushTest,
    assess_stability,
    by_stance_angle,
    compass_biped,
    computed_torque,
    feedforward,
    joint_pd,
    load,
    step_lqr,
)
from gaitopt.control import PlanarLaw, passive
from gaitopt.control.torque_noise import add_torque_noise
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.stability import PlanarWalkProblem
from gaitopt.study import WalkTest, assess_robustness
from gaitopt.study.robustness.disturbed_gait import reads_state
from gaitopt.study.robustness.robustness_margins import _MarginSearch


@pytest.fixture(scope="module")
def gait():
    return load("docs/examples/compass_slip.h5")


def torque(law, clock, q, v, latched=(), slide=0):
    return law.torque_at(clock, q, v, latched=latched, slide=slide)


@pytest.mark.slow
def test_every_kind_is_survived_up_to_a_limit(gait):
    robot = compass_biped()
    law = computed_torque(robot, gait.motion, stiffness=25, damping=10, torque_limit=8)
    cycle = assess_stability(gait, law)
    test, walking, counted = PushTest(starts=3, resolution=0.4), WalkTest(steps=8, patch=2, resolution=0.3), []
    with ThreadPoolExecutor(1) as executor:  # what it is sent is packed as for another process
        more = {"executor": executor, "observer": lambda *done: counted.append(done)}
        every = assess_robustness(robot, law, cycle, walking=walking, test=test, execution=Execution(**more))
    assert counted == [(number, 6) for number in range(1, 7)]
    found = {each.kind: each for each in every}
    assert set(found) == {"push", "downhill slope", "uphill slope", "friction patch", "torque noise", "sensor delay"}
    for each in found.values():
        assert each.survived > 0
        assert each.failed is None or each.failed >= each.survived
    assert found["uphill slope"].survived < 0.1
    assert 0 < found["sensor delay"].survived < gait.period / 2


def test_planned_torques_read_no_sensor_and_have_no_margin_of_its_delay(gait):
    robot, law = compass_biped(), feedforward(compass_biped(), gait.motion)
    walking, test = WalkTest(steps=1, patch=1, resolution=1.0), PushTest(starts=1, steps=1, resolution=1.0)
    kinds = [each.kind for each in assess_robustness(robot, law, assess_stability(gait), walking=walking, test=test)]
    assert kinds == ["push", "downhill slope", "uphill slope", "friction patch", "torque noise"]
    assert reads_state(step_lqr(robot, gait.motion))  # latched values depend on the state


def test_stated_kinds_are_returned_in_the_order_of_all_kinds_and_unknown_ones_are_rejected(gait):
    robot, law = compass_biped(), feedforward(compass_biped(), gait.motion)
    cycle, walking = assess_stability(gait), WalkTest(steps=1, patch=1, resolution=1.0)
    margins = assess_robustness(robot, law, cycle, walking=walking, kinds=["torque noise", "uphill slope"])
    assert [margin.kind for margin in margins] == ["uphill slope", "torque noise"]
    with pytest.raises(InputError, match="The disturbance 'sensor delay' does not apply to this gait and law"):
        assess_robustness(robot, law, cycle, kinds=["sensor delay"])


@pytest.mark.parametrize("limit", [np.inf, 8.0])
def test_noise_is_added_before_the_limits(gait, limit):
    robot, segment = compass_biped(), gait.motion.segments[1]
    noise = np.array([np.linspace(0, 0.9, 10), np.linspace(-20, 20, 10)])
    for law, more in (
        (computed_torque(robot, gait.motion, stiffness=25, damping=10, torque_limit=limit), ()),
        (step_lqr(robot, gait.motion, torque_limit=limit), ([0.1, 0.2, 0.3, 0.4], 0)),
    ):
        shaken = add_torque_noise(law, noise, gait.period)
        for k in (3, 40, -2):
            clock, q, v = segment.time[k], segment.q[:, k], segment.v[:, k] + np.array([0, 0, 0.01, 0])
            part = min(int(10 * clock / gait.period), 9)
            expected = np.clip(torque(law, clock, q, v, *more) + noise[:, part], -limit, limit)
            assert torque(shaken, clock, q, v, *more) == pytest.approx(expected, abs=1e-9)


def test_noise_on_a_law_by_the_stance_angle_lasts_for_parts_of_the_angle(gait):
    robot, first, last = compass_biped(), gait.motion.segments[0], gait.motion.segments[-1]
    law = by_stance_angle(robot, gait.motion, joint_pd(robot, gait.motion, damping=5))
    noise = np.array([np.linspace(0, 0.9, 10), np.linspace(-2, 2, 10)])
    shaken, begin, end = add_torque_noise(law, noise, gait.period), first.q[2, 0], last.q[2, -1]
    for share in (-0.1, 0.03, 0.46, 0.99, 1.2):
        q, v = last.q[:, 9].copy(), last.v[:, 9]
        q[2] = begin + share * (end - begin)
        columns = [each.table[:, each.piece(q[2])] for each in (law, shaken)]
        plain, added = (
            each.torque(0.0, q, v, [], 0, column) for each, column in zip((law, shaken), columns, strict=True)
        )
        part = min(max(int(10 * share), 0), 9)
        assert np.asarray(added[0] - plain[0]).ravel() == pytest.approx(noise[:, part], abs=1e-9)
        assert np.all(np.asarray(added[1]) > 0)
        assert columns[1][:2].tolist() == [shaken.breakpoints[shaken.piece(q[2])], columns[1][1]]


@pytest.mark.slow
def test_a_robot_without_actuators_has_no_torque_noise():
    robot = vertical_hopper()
    law = PlanarLaw("passive", "sole closes", (passive(robot),))
    problem = PlanarWalkProblem(
        robot=robot, section="sole closes", coordinates={"body": 0.7, "foot": 0.2}, rates={}, on=(), torque=law
    )
    (cycle,) = problem.search(1)
    test = PushTest(starts=1, steps=40, tolerance=1e-3, resolution=0.9)
    margins = assess_robustness(robot, law, cycle, walking=WalkTest(steps=6, resolution=0.9), test=test)
    assert [each.kind for each in margins] == ["push", "downhill slope", "uphill slope"]  # with infinite friction


@pytest.mark.parametrize(("kind", "least"), [("sensor delay", 1e-3), ("torque noise", 1e-6)])
def test_a_margin_below_the_smallest_disturbance_is_zero(kind, least):
    """A walk with a delay takes the longer, the shorter the delay is."""
    tried = []
    search = _MarginSearch(gait=None, cycle=None, walking=WalkTest(), test=PushTest())
    margin = search.largest(kind, lambda size: bool(tried.append(size)), 0.4, "1")
    assert (margin.survived, margin.failed) == (0.0, min(tried))
    assert 0.4 * least / 2 < min(tried) <= 0.4 * least
