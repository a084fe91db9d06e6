"""Sensitivity to gains against differences of whole assessments."""

import dataclasses

import numpy as np
import pytest

from gaitopt import InputError, assess_stability, compass_biped, gain_sensitivity, joint_pd, load
from gaitopt.stability.gain_sensitivity import latch_gains, return_map_with

NAMES = ("hip_stiffness", "hip_damping")


@pytest.fixture(scope="module")
def setting():
    """A walker that is heavier than the plan, so that its periodic gait depends on the gains."""
    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    law = joint_pd(robot, gait.motion, stiffness=20, damping=3, torque_limit=8)
    changed = {**gait.motion.parameters, "hip_mass": 2.1}
    return gait, robot, law, changed


def cycle_of(setting, law):

    gait, _, _, changed = setting
    heavier = dataclasses.replace(gait, motion=dataclasses.replace(gait.motion, parameters=changed))
    return assess_stability(heavier, law)


@pytest.mark.slow
def test_it_agrees_with_differences_of_whole_assessments(setting):
    law = setting[2]
    found = gain_sensitivity(cycle_of(setting, law), law, gains=NAMES)
    for k, name in enumerate(NAMES):
        gain, step = law.gain_values[name], 1e-3
        one, two = (cycle_of(setting, law.with_gains({name: gain + sign * step})) for sign in (1, -1))
        assert found.state[:, k] == pytest.approx(
            (one.z - two.z) / (2 * step), abs=1e-6 * np.max(np.abs(found.state)) + 1e-9
        )
        assert found.radius[k] == pytest.approx((one.radius - two.radius) / (2 * step), abs=1e-5)


def test_gains_as_latched_values_walk_the_same(setting):
    _, robot, law, _ = setting
    cycle = cycle_of(setting, law)
    ends = [return_map_with(cycle, each, robot, None)(cycle.z).end for each in (law, latch_gains(law, NAMES))]
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


def test_unknown_gains_are_refused(setting):
    law = setting[2]
    with pytest.raises(InputError, match="no gain 'knee'"):
        gain_sensitivity(cycle_of(setting, law), law, gains=["knee"])
