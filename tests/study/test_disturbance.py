"""Disturbances of controlled gaits."""

import numpy as np
import pytest

from gaitopt import PushTest, Walking, assess_stability, compass_biped, computed_torque, endurance, load, step_lqr
from gaitopt.study.disturbance import noisy


@pytest.fixture(scope="module")
def gait():
    return load("docs/examples/compass_slip.h5")


def torque(law, clock, q, v, *more):
    return np.asarray(law.torque(clock, q, v, law.table[:, law.piece(clock)], *more)).ravel()


def test_every_kind_is_survived_up_to_a_limit(gait):
    robot = compass_biped()
    law = computed_torque(robot, gait.motion, stiffness=25, damping=10, torque_limit=8)
    cycle = assess_stability(gait, law)
    test, walking = PushTest(starts=3, resolution=0.4), Walking(steps=8, patch=2, resolution=0.3)
    found = {each.kind: each for each in endurance(robot, law, cycle, walking=walking, test=test)}
    assert set(found) == {"push", "downhill slope", "uphill slope", "friction patch", "torque noise"}
    for each in found.values():
        assert each.survived > 0
        assert each.failed is None or each.failed >= each.survived
    assert found["uphill slope"].survived < 0.1


@pytest.mark.parametrize("limit", [np.inf, 8.0])
def test_noise_is_added_before_the_limits(gait, limit):
    robot, segment = compass_biped(), gait.motion.segments[1]
    noise = np.array([np.linspace(0, 0.9, 10), np.linspace(-20, 20, 10)])
    for law, more in (
        (computed_torque(robot, gait.motion, stiffness=25, damping=10, torque_limit=limit), ()),
        (step_lqr(robot, gait.motion, torque_limit=limit), ([0.1, 0.2, 0.3, 0.4], 0)),
    ):
        shaken = noisy(law, noise, gait.period)
        for k in (3, 40, -2):
            clock, q, v = segment.time[k], segment.q[:, k], segment.v[:, k] + np.array([0, 0, 0.01, 0])
            part = min(int(10 * clock / gait.period), 9)
            expected = np.clip(torque(law, clock, q, v, *more) + noise[:, part], -limit, limit)
            assert torque(shaken, clock, q, v, *more) == pytest.approx(expected, abs=1e-9)
