"""Location of the end of a branch at which the walker just rolls over an upright equilibrium.

A step takes infinitely long there, and the derivative of the return map is singular, so that Newton's method fails
before this end.  The kinetic energy at the apex, where it is least, is a smooth function of the parameter up to the
end, at which it is zero: the states at the equilibrium are those of an energy, not of a return time.  Its zero is
extrapolated from gaits at such distances that their steps are short.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaitopt.continuation.pseudo_arclength import CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.motion.motion import Array

SAMPLES = 4
"""Number of gaits from which the end is extrapolated."""
DISTANCE = 1e-4
"""Distance between them, relative to the range of the parameter, or of both parameters on a line."""
LARGEST_SHIFT = 0.1
"""Largest distance of the extrapolated end from the last gait, relative to that between the gaits; if the walker falls
with kinetic energy, the extrapolated zero is further away."""


def locate_roll_over(stepper: Stepper, point: CurvePoint, end: SpecialPoint) -> SpecialPoint:
    """Return the end of a branch at the zero of the kinetic energy at the apex; unchanged if this is not its cause.

    Parameters
    ----------
    stepper : Stepper
    point : CurvePoint
        Last gait for which Newton's method converges.
    end : SpecialPoint
        End of the branch at this gait.
    """
    family, start = stepper.family, stepper.position(point)
    distance = DISTANCE / family.value_scale if family.line else DISTANCE
    samples = _sample(stepper, point, distance) or _sample(stepper, point, -distance)
    if samples is None:
        return end
    energies, places = samples
    place = _extrapolate(energies, places)
    # Independent errors of the integrator shift the place by 8.3 times their size, and change the difference by 17.9
    # times; the difference from the place without the farthest gait would change by 4.5 times only.
    shift, error = float(place[-1] - start[-1]), float((place - _extrapolate(energies[:-1], places[:-1]))[-1])
    if not abs(shift) <= LARGEST_SHIFT * distance:
        return end
    *z, value = (place * stepper.scales).tolist()
    width = max(abs(error) * family.value_scale, 1e-16)
    return replace(end, value=value, z=np.array(z), width=width, test=0.0)


def _sample(stepper: Stepper, point: CurvePoint, distance: float) -> tuple[list[float], list[Array]] | None:
    """Return the energies at the apex of gaits on one side of the last one, and their places; None if there are none.

    The tangent of the last gait does not state on which side they are: the derivative is inaccurate there.
    """
    axis = np.eye(stepper.scales.size)[-1]
    start, energies, places = stepper.position(point), list[float](), list[Array]()
    for number in range(SAMPLES, 0, -1):
        gait = stepper.correct(start + number * distance * axis, axis)
        if gait is None or gait.sample.structure != point.sample.structure:
            return None
        energy = stepper.family.apex_energy(gait.z, gait.value, gait.sample)
        if energy is None:
            return None
        energies.append(energy)
        places.append(stepper.position(gait))
    return energies, places


def _extrapolate(energies: Sequence[float], places: Sequence[Array]) -> Array:
    """Return the place of zero energy on the polynomial through places at given energies."""
    weights = [math.prod(other / (other - one) for other in energies if other != one) for one in energies]
    return np.asarray(np.dot(weights, places))
