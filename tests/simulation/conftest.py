"""Walks of the two robots of the study, in its own coordinates, with each engine."""

import dataclasses
import functools

import numpy as np
import pytest

from gaitopt import ScipyEngine, compass_biped, rimless_wheel, simulate
from gaitopt.simulation import StepLimits
from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from tests.newton_euler.compass import HandCompass
from tests.newton_euler.wheel import HandWheel

COMPASS = HandCompass(slope=np.deg2rad(1))
WHEEL = HandWheel()

# Gamus & Or (2015), passive compass l = 1.6 m, d = 0.8 m, m = 4 kg, m_h = 2 kg, g = 9.8 m/s2, slope 1 deg: states
# after impact and leg swap (th1 = th2, th1d, th2d), then the foot's speed, friction, period.
GAIT_A = {"z": (-0.147836890, 0.732796791, -0.500667882), "xd": 0.0, "mu": 0.3, "T": 0.744620868}
GAIT_B = {"z": (-0.140807105, 0.710208797, -0.516847656), "xd": 0.0, "mu": 0.14, "T": 0.751962}
GAIT_C = {"z": (-0.079038, 0.043777, -0.431761), "xd": 0.634174, "mu": 0.14, "T": 0.635815}


def walk_compass(z, *, xd=0.0, mu=np.inf, robot=COMPASS, steps=1, **options):
    """Simulate the compass from section coordinates (th1, th1d, th2d) and a foot speed."""
    options.setdefault("step_limits", StepLimits(duration=3.0))
    hand = dataclasses.replace(robot, mu=mu)
    return simulate(compass_biped(), [0, 0, z[0], z[0]], [xd, 0, z[1], z[2]], hand.parameters, steps=steps, **options)


def walk_wheel(rate, *, xd=0.0, mu=np.inf, steps=1, robot=WHEEL, **options):
    """Simulate the wheel from the start of a step; speeds per tau_c = sqrt(1 + kappa), with l = g = m = 1."""
    hand = dataclasses.replace(robot, mu=mu)
    unit = np.sqrt(1 + hand.kappa)
    v = [xd / unit, 0, rate / unit]
    limits = StepLimits(duration=30.0)
    return simulate(rimless_wheel(), [0, 0, -hand.half], v, hand.parameters, steps=steps, step_limits=limits, **options)


@pytest.fixture(params=["scipy", "heyoka"])
def engine(request):
    if request.param == "scipy":
        return ScipyEngine()
    pytest.importorskip("heyoka")
    return HeyokaEngine()


@pytest.fixture
def compass_walk(engine):
    return functools.partial(walk_compass, engine=engine)


@pytest.fixture
def wheel_walk(engine):
    return functools.partial(walk_wheel, engine=engine)


@pytest.fixture(params=[GAIT_A, GAIT_B, GAIT_C], ids=["A", "B", "C"])
def passive_gait(request):
    return request.param


@pytest.fixture
def gait_a():
    return GAIT_A


@pytest.fixture
def gait_b():
    return GAIT_B


@pytest.fixture
def gait_c():
    return GAIT_C


@pytest.fixture
def hand_compass():
    return COMPASS


@pytest.fixture
def hand_wheel():
    return WHEEL
