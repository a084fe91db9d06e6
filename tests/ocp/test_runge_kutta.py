"""Coefficients of the Runge-Kutta method by which plans are integrated."""

import numpy as np
from scipy.integrate import DOP853

from gaitopt.ocp.solution import runge_kutta


def test_the_coefficients_are_those_of_scipy():
    for name in ("A", "B", "C"):
        np.testing.assert_array_equal(getattr(runge_kutta, name), getattr(DOP853, name))
