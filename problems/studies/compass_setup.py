"""The study's passive compass biped and its Gaits A, B and C."""

import functools
import math

from gaitopt import compass_biped, find_cycles, simulate

SLOPE, FRICTION = 1.0, 0.14
"""The study's slope [deg], and the friction at which Gaits B and C are shown."""

SEQUENCES = {"A": "stick | stick", "B": "slip+ stick slip- | stick", "C": "slip+ stick | slip+"}


def biped(friction=math.inf, slope=SLOPE):
    """Return the parameters of the study's biped on a slope [deg]."""
    return {
        "leg_length": 1.6,
        "leg_com": 0.8,
        "leg_mass": 4.0,
        "hip_mass": 2.0,
        "gravity": 9.8,
        "slope": math.radians(slope),
        "friction": friction,
    }


@functools.cache
def gait(name, friction, starts=100):
    """Return Gait A, B or C at a friction; the stable one where two have its contact sequence.

    Raises
    ------
    LookupError
        If none is found.
    """
    found = [cycle for cycle in _gaits(friction, starts) if cycle.sequence == SEQUENCES[name]]
    if not found:
        raise LookupError(f"Gait {name} was not found at friction {friction:g}; give more starts.")
    return found[0]


@functools.cache
def _gaits(friction, starts):
    return find_cycles(compass_biped(), biped(friction), starts=starts)


def walk(cycle, steps=1):
    """Simulate steps of a gait."""
    state = cycle.section.embed(cycle.z)
    return simulate(compass_biped(), state[:4], state[4:], cycle.parameters, steps=steps).motion
