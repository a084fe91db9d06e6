"""Limits at which the rimless wheel just rolls over its upright equilibrium, from the energy of its steps."""

import math

from scipy.integrate import solve_ivp
from scipy.optimize import brentq

HALF, INERTIA = math.pi / 10, 1 / 3
"""Half the angle between spokes and the inertia ratio of the wheel of Gamus & Or (2015)."""


def least_slope():
    """Return the slope at which the rate of Type A after the impact carries the wheel just to its apex (1.40 deg)."""
    kept = (math.cos(2 * HALF) + INERTIA) / (1 + INERTIA)

    def excess(slope):
        return kept * math.sqrt(math.sin(slope) * math.sin(HALF) / (1 - kept**2)) - math.sin((HALF - slope) / 2)

    return brentq(excess, 0.01, 0.1, xtol=1e-15)


def least_friction():
    """Return the friction at which this holds for Type D, at every slope.

    The squared rate w(theta) in complete slip, with mass, spoke and normal gravity 1, follows from the balances of
    rotation and of vertical motion, and begins at the apex, tan(theta) = -mu, with zero:
    (kappa + sin(theta) s) w' / 2 = s (1 - cos(theta) w), where s = sin(theta) + mu cos(theta).
    """

    def squared_rate(mu, end):
        def slope(theta, w):
            s = math.sin(theta) + mu * math.cos(theta)
            return [2 * s * (1 - math.cos(theta) * w[0]) / (INERTIA + math.sin(theta) * s)]

        return solve_ivp(slope, (-math.atan(mu), end), [0.0], method="DOP853", rtol=3e-14, atol=1e-16).y[0, -1]

    def excess(mu):
        slip = math.sin(HALF) * (math.sin(HALF) - mu * math.cos(HALF))
        kept = (INERTIA - slip) / (INERTIA + slip)
        return kept**2 * squared_rate(mu, HALF) - squared_rate(mu, -HALF)

    return brentq(excess, 0.05, 0.1, xtol=1e-16)
