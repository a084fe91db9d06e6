"""The rimless wheel of the study in natural units, and its gaits by type.

The unit of length is the spoke length l, that of time is tau_c = sqrt((m l^2 + I_c) / (m g l)).  With l = m = 1, tau_c
is 1 if g = 1 + I_c / (m l^2).
"""

import functools
import math

from gaitopt import find_cycles, rimless_wheel, simulate

SPOKES, INERTIA_RATIO, SLOPE = 10, 1 / 3, 13.0
HALF = math.pi / SPOKES
RATE, SPEED = r"rad/$\tau_c$", r"$l/\tau_c$"
"""Units of rates and of foot speeds, for axes."""

TYPES = {
    "stick | stick": "A",
    "stick slip+ | stick": "B",
    "slip+ stick slip+ | stick": "B",
    "slip+ stick slip+ | slip+": "C",
    "slip+ | slip+": "D",
}
"""Type of a gait by its contact sequence."""


def wheel(friction=math.inf, slope=SLOPE, spokes=SPOKES, inertia_ratio=INERTIA_RATIO):
    """Return the parameters of a wheel on a slope [deg] for which l, m and tau_c are 1."""
    return {
        "spokes": spokes,
        "leg_length": 1.0,
        "mass": 1.0,
        "inertia_ratio": inertia_ratio,
        "gravity": 1 + inertia_ratio,
        "slope": math.radians(slope),
        "friction": friction,
    }


@functools.cache
def gait(kind, friction, starts=40):
    """Return the gait of a type, A to D, at a friction coefficient.

    Raises
    ------
    LookupError
        If no such gait is found.
    """
    for cycle in find_cycles(rimless_wheel(), wheel(friction), starts=starts):
        if TYPES.get(cycle.sequence) == kind:
            return cycle
    raise LookupError(f"No gait of Type {kind} was found at friction {friction:g}; increase `starts`.")


def speed_of(cycle):
    """Return the rate of theta just after the impact of a gait [rad/tau_c]."""
    return cycle.state["theta_rate"]


def walk(rate, friction=math.inf, foot_speed=0.0, steps=1, slope=SLOPE, spokes=SPOKES, inertia_ratio=INERTIA_RATIO):
    """Simulate the wheel from the start of a step, theta = -pi/n, with a rate and a foot speed."""
    parameters = wheel(friction, slope, spokes, inertia_ratio)
    return simulate(rimless_wheel(), [0, 0, -math.pi / spokes], [foot_speed, 0, rate], parameters, steps=steps)
