"""A foot at rest with a force just outside the friction cone slides for a very short time in both engines."""

import math

import numpy as np
import pytest

from gaitopt import Mode, compass_biped, passive
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine

ROBOT = compass_biped()
GAIT_A = np.array([0, 0, -0.147836890, -0.147836890, 0, 0, 0.732796791, -0.500667882])
SLOPE = math.radians(1)


def force_ratio():
    """Return f_t / f_n of the sticking foot at the start of Gait A, the critical friction of the gait."""
    p = ROBOT.vector(ROBOT.resolve({"slope": SLOPE}))
    force = ROBOT.acceleration[Mode.STICK](GAIT_A[:4], GAIT_A[4:], [0, 0], p)[1]
    tangential, normal = np.asarray(force).ravel()
    return abs(tangential) / normal


def step_at(excess, engine):
    friction = force_ratio() * (1 - excess)
    p = ROBOT.vector(ROBOT.resolve({"slope": SLOPE, "friction": friction}))
    return Walker(ROBOT, passive(ROBOT), p, engine).walk_step(GAIT_A)


@pytest.mark.parametrize("excess", [1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 3e-7, 1e-6, 1e-5])
def test_the_slide_is_as_long_as_the_excess_of_the_force(excess):
    # To first order the force enters the cone after a time in proportion to the excess, and the foot rests after twice
    # that time: 0.485 s times the excess at excess 1e-5, where both engines agree.
    reference, fast = step_at(excess, ScipyEngine()), step_at(excess, default_engine())
    assert [mode.value for mode in reference.modes] == [mode.value for mode in fast.modes] == ["slip+", "stick"]
    assert reference.arcs[0][1].time[-1] == pytest.approx(0.485 * excess, rel=3e-3)
    assert reference.following == pytest.approx(fast.following, abs=1e-9)


@pytest.mark.parametrize("excess", [-1e-10, -1e-7])
def test_a_force_inside_the_cone_sticks(excess):
    assert [mode.value for mode in step_at(excess, ScipyEngine()).modes] == ["stick"]
