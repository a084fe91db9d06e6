"""Closed forms of the rimless wheel that never slips, in natural units (l = 1, m = 1, tau_c = 1).

Energy is conserved over a step, thd^2 / 2 + cos(theta + alpha) = const, and the impact multiplies thd by beta.
Angles are in rad, and thd is the rate of theta.  The least friction of complete slip follows from a linear differential
equation.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar


def velocity_ratio(spokes, inertia_ratio):
    """Return beta, the ratio of thd after an impact to thd before it."""
    return (math.cos(2 * math.pi / spokes) + inertia_ratio) / (1 + inertia_ratio)


def gait_speed(spokes, inertia_ratio, slope):
    """Return thd* just after the impact of the sticking gait."""
    squared = velocity_ratio(spokes, inertia_ratio) ** 2
    return math.sqrt(4 * math.sin(slope) * math.sin(math.pi / spokes) * squared / (1 - squared))


def slowest_speed(spokes, slope):
    """Return the smallest thd at theta = -pi/n with which the wheel rolls over."""
    return 2 * math.sin(max(math.pi / spokes - slope, 0.0) / 2)


def force(theta, rate, spokes, inertia_ratio, slope):
    """Return (f_t, f_n) / (m g) at an angle of a step with a given initial rate."""
    squared = rate**2 + 2 * (math.cos(slope - math.pi / spokes) - np.cos(theta + slope))
    bend, pull = np.sin(theta + slope) / (1 + inertia_ratio), squared / (1 + inertia_ratio)
    tangential = np.cos(theta) * bend - np.sin(theta) * pull - math.sin(slope)
    normal = math.cos(slope) - np.sin(theta) * bend - np.cos(theta) * pull
    return tangential, normal


def least_normal_force(rate, spokes, inertia_ratio, slope):
    """Return the smallest f_n / (m g) of a step with a given initial rate, and its angle."""
    half = math.pi / spokes
    theta = np.linspace(-half, half, 201)
    k = int(np.argmin(force(theta, rate, spokes, inertia_ratio, slope)[1]))
    minimum = minimize_scalar(
        lambda angle: force(angle, rate, spokes, inertia_ratio, slope)[1],
        bounds=(theta[max(k - 1, 0)], theta[min(k + 1, 200)]),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return min(
        (float(force(angle, rate, spokes, inertia_ratio, slope)[1]), float(angle)) for angle in (theta[k], minimum.x)
    )


def fastest_speed(spokes, inertia_ratio, slope):
    """Return the largest thd at theta = -pi/n with which the foot stays on the ground."""
    return brentq(lambda rate: least_normal_force(rate, spokes, inertia_ratio, slope)[0], 1e-6, 5.0, xtol=1e-13)


def slope_range(spokes, inertia_ratio):
    """Return the slopes between which the sticking gait exists: lower limit (rolling over), upper limit (contact).

    They are equal or in reverse order if there is no gait.
    """

    def rate_margin(slope):
        return gait_speed(spokes, inertia_ratio, slope) - slowest_speed(spokes, slope)

    def normal_force_margin(slope):
        return least_normal_force(gait_speed(spokes, inertia_ratio, slope), spokes, inertia_ratio, slope)[0]

    lower = brentq(rate_margin, 1e-9, math.pi / spokes, xtol=1e-13)
    upper = brentq(normal_force_margin, 1e-9, math.pi / 2 - 1e-9, xtol=1e-13)
    return lower, upper


def least_friction(spokes, inertia_ratio):
    """Return the friction below which the wheel in complete slip no longer rolls over, at every slope.

    The balances of rotation and of normal motion determine the squared rate w(theta) in units of g cos(alpha) / l:
    (kappa + sin(theta) s) w' / 2 = s (1 - cos(theta) w), where s = sin(theta) + mu cos(theta) and kappa is the inertia
    ratio.  If the wheel just rolls over, w = 0 at the apex, where s = 0; the impact multiplies thd by
    (kappa - S) / (kappa + S), where S = sin(pi/n) (sin(pi/n) - mu cos(pi/n)).
    """
    half = math.pi / spokes

    def rate_margin(friction):
        shift = math.sin(half) * (math.sin(half) - friction * math.cos(half))
        ratio = (inertia_ratio - shift) / (inertia_ratio + shift)
        last, first = (_squared_rate(angle, friction, inertia_ratio) for angle in (half, -half))
        return ratio**2 * last - first

    return brentq(rate_margin, 1e-9, math.tan(half), xtol=1e-15)


def _squared_rate(angle, friction, inertia_ratio):
    """Return w at an angle of a step in complete slip in which the wheel just rolls over."""

    def slope(theta, squared):
        bend = math.sin(theta) + friction * math.cos(theta)
        return 2 * bend * (1 - math.cos(theta) * squared) / (inertia_ratio + math.sin(theta) * bend)

    apex = -math.atan(friction)
    return float(solve_ivp(slope, (apex, angle), [0.0], method="DOP853", rtol=1e-13, atol=1e-15).y[0, -1])
