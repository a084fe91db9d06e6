"""Gaits from elsewhere in the literature, walked without a friction limit."""

import numpy as np
import pytest

from gaitopt.simulation import StepLimits
from tests.newton_euler.compass import HandCompass


def section(walk):
    jump = walk.motion.jumps[-1]
    return np.array([jump.q_next[2], *jump.v_next[2:]])


def test_goswamis_compass(compass_walk):
    """m = 5, m_h = 10, l = 1, d = 0.5, slope 3 deg, g = 9.81 (Goswami et al. 1996): own fixed point and period."""
    robot = HandCompass(length=1.0, com=0.5, mass=5.0, hip=10.0, gravity=9.81, slope=np.deg2rad(3))
    z = (-0.2710286805, 1.0923835899, -0.3773739489)
    walk = compass_walk(z, robot=robot)
    np.testing.assert_allclose(section(walk), z, atol=5e-10)
    assert walk.motion.period == pytest.approx(0.7343464, abs=5e-8)


def test_simplest_walker(compass_walk):
    """Garcia et al. (1998), slope 0.009: th = 0.2003109005442, thd = -0.1998324730050 (their signs), feet without mass.

    The compass with its leg mass at the foot tends to it as that mass vanishes; the rate of the swing leg follows from
    the massless foot keeping its velocity across the leg: th2d = -cos(2 th1) th1d.
    """
    th, rate = -0.2003109005442, 0.1998324730050
    z = np.array([th, rate, -np.cos(2 * th) * rate])
    errors = []
    for ratio in (1e-3, 1e-4):
        robot = HandCompass(length=1.0, com=0.0, mass=ratio, hip=1.0, gravity=1.0, slope=0.009)
        errors.append(np.max(np.abs(section(compass_walk(z, robot=robot, step_limits=StepLimits(duration=10.0))) - z)))
    assert errors[1] < 1e-3
    assert errors[1] == pytest.approx(errors[0] / 10, rel=0.1)  # the error is that of the mass ratio
