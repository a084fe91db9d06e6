"""The centre of mass of a robot, against its masses."""

import numpy as np
import pytest

from gaitopt import compass_biped
from gaitopt.model.centre_of_mass import centre_of_mass
from tests.walkers.sprung_compass import sprung_compass

COMPASS = compass_biped()


@pytest.mark.parametrize("robot", [COMPASS, sprung_compass("spring")], ids=["compass", "with a spring"])
def test_the_centre_of_mass_of_a_compass_is_that_of_its_masses(robot):
    slope, length, com, leg, hip = 0.03, 1.6, 0.7, 4.0, 2.0
    p = robot.vector(
        robot.resolve({"slope": slope, "leg_length": length, "leg_com": com, "leg_mass": leg, "hip_mass": hip})
    )
    (th1, th2), (speed, w1, w2) = (-0.21, -0.18), (0.3, 0.9, -0.5)
    stance, swing = np.array([np.sin(th1), np.cos(th1)]), np.array([np.sin(th2), -np.cos(th2)])
    turn1, turn2 = np.array([np.cos(th1), -np.sin(th1)]) * w1, np.array([np.cos(th2), np.sin(th2)]) * w2
    masses, foot = np.array([leg, hip, leg]) / (2 * leg + hip), np.array([speed, 0])
    places = np.array([com * stance, length * stance, length * stance + (length - com) * swing])
    rates = np.array([foot + com * turn1, foot + length * turn1, foot + length * turn1 + (length - com) * turn2])
    offset, velocity = centre_of_mass(robot)([0.4, 0, th1, th2], [speed, 0, w1, w2], p)
    assert np.asarray(offset).ravel() == pytest.approx(masses @ places, rel=1e-12)
    assert np.asarray(velocity).ravel() == pytest.approx(masses @ rates, rel=1e-12)
