"""The passive compass biped of the study and its Gaits A, B and C."""

import functools
import math

from gaitopt import compass_biped, find_cycles, simulate

SLOPE, FRICTION = 1.0, 0.14
"""Slope of the study [deg], and the friction at which Gaits B and C are shown."""

SEQUENCES = {"A": "stick | stick", "B": "slip+ stick slip- | stick", "C": "slip+ stick | slip+"}


def biped(friction=math.inf, slope=SLOPE):
    """Return the parameters of the biped on a slope [deg]."""
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
def gait(name, friction, starts=40):
    """Return Gait A, B or C at a friction coefficient; if two gaits share the contact sequence, the stable one.

    Raises
    ------
    LookupError
        If no such gait is found.
    """
    matches = [cycle for cycle in _gaits(friction, starts) if cycle.sequence == SEQUENCES[name]]
    if not matches:
        raise LookupError(f"Gait {name} was not found at friction {friction:g}; increase `starts`.")
    return matches[0]


@functools.cache
def _gaits(friction, starts):
    return find_cycles(compass_biped(), biped(friction), starts=starts)


def walk(cycle, steps=1):
    """Simulate steps of a gait."""
    state = cycle.section.embed(cycle.z)
    return simulate(compass_biped(), state[:4], state[4:], cycle.parameters, steps=steps).motion
