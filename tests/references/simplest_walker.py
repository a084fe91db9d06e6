"""The simplest walker without gaitopt: the equations of Garcia, Chatterjee, Ruina & Coleman (1998), slope 0.009 rad.

    theta'' - sin(theta - gamma) = 0
    theta'' - phi'' + theta'^2 sin(phi) - cos(theta - gamma) sin(phi) = 0

in units of leg length and gravity; heelstrike at phi = 2 theta.  Integrated to events at a relative tolerance of 1e-12,
multipliers by central differences.
"""

import math

import numpy as np

from tests.references.event_driven import fixed_point, take_step
from tests.references.storage import run

GAMMA = 0.009


class SimplestWalker:
    """The walker of `event_driven` with state (theta, phi, foot speed = 0, theta rate, phi rate)."""

    speed, mu, impact_mu, stick_at_start = 2, math.inf, math.inf, True

    def motion(self, mode, y):
        theta, phi, _, rate, phi_rate = y
        a = math.sin(theta - GAMMA)
        return np.array([rate, phi_rate, 0.0, a, a + (rate**2 - math.cos(theta - GAMMA)) * math.sin(phi)]), 0.0, 1.0

    def guard(self, y):
        return 2 * y[0] - y[1]

    def armed(self, y):
        return y[0] < 0

    def impact(self, y, mode):
        theta, turn = y[0], math.cos(2 * y[0])
        after = [-theta, -2 * theta, 0.0, turn * y[3], turn * (1 - turn) * y[3]]
        return np.array(after), np.array([0.0, 1.0])


def long_period():
    """The stable gait: th1 = -theta and its rate just after heelstrike."""
    walker = SimplestWalker()

    def start(z):
        theta, rate = -z
        return np.array([theta, 2 * theta, 0.0, rate, (1 - math.cos(2 * theta)) * rate])

    def image(z):
        return -take_step(walker, start(z)).after[[0, 3]]

    z, matrix = fixed_point(image, np.array([-0.2003, 0.1998]))
    return {"z": z, "multipliers": np.linalg.eigvals(matrix), "period": take_step(walker, start(z)).period}


COMPUTATIONS = {"long_period": (long_period, 1e-10)}
QUICK = ("long_period",)

if __name__ == "__main__":
    run("simplest_walker", COMPUTATIONS)
