"""Switching to the branches that leave a period doubling or a branch point.

A branch of twice the period leaves a period doubling along the eigenvector of the multiplier -1, perpendicular to the
axis of the parameter.  A point of it lies in the plane across this direction at a small distance, in which the
original branch has no point.
"""

import numpy as np

from gaitopt.continuation.checkpoint import Checkpoint
from gaitopt.continuation.map_family import MapFamily
from gaitopt.continuation.pseudo_arclength import ArclengthOptions, CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint
from gaitopt.motion.motion import Array

AMPLITUDES = (1e-3, 3e-4, 3e-3, 1e-2, 1e-4)
"""Scaled distances from a special point at which the other branch is sought, in order."""
DISTINCT_HALVES = 0.1
"""Smallest difference between the halves of a doubled period, relative to the distance from the period doubling; it is
twice this distance to first order."""

SAME_STEP = 1e-3
"""Largest scaled difference between the steps of two halves of a period that count as equal."""


def switch_branch(
    family: MapFamily,
    special: SpecialPoint,
    options: ArclengthOptions,
    sign: float = 1.0,
    *,
    reduction: float = 1.0,
    checkpoint: Checkpoint | None = None,
) -> tuple[Stepper, CurvePoint] | None:
    """Return a stepper and the first point of the branch that leaves a special point, or None if none exists.

    Parameters
    ----------
    family : MapFamily
        At a period doubling, the family of the doubled maps.
    special : SpecialPoint
        Period doubling or branch point.
    options : ArclengthOptions
    sign : float
        Side of the special point: both sides of a doubled branch are the same gait.
    reduction : float
        Factor of the distances from the special point, for doubled branches far along a cascade, which are short.
    checkpoint : Checkpoint, optional
    """
    if special.direction is None:
        return None
    stepper = Stepper(family, options, checkpoint)
    start = np.append(special.z, special.value) / stepper.scales
    normal = np.append(sign * special.direction, 0.0)
    doubled = special.kind is SpecialKind.PERIOD_DOUBLING
    for amplitude in (reduction * size for size in AMPLITUDES):
        point = stepper.correct(start + amplitude * normal, normal)
        if point is None or float(np.linalg.norm(stepper.position(point) - start)) > 10 * amplitude:
            continue
        # The plane can also contain a point of the original branch, which repeats after half the period.
        if not (doubled and has_half_period(point.orbit, family.scale, DISTINCT_HALVES * amplitude)):
            return stepper, point
    return None


def has_half_period(orbit: Array, scale: Array, difference: float = SAME_STEP) -> bool:
    """Return whether a gait repeats after half its period.

    A branch of doubled period folds back onto itself, with its steps exchanged, where it joins the branch of half its
    period.

    Parameters
    ----------
    orbit : (steps, n) array
        State at the start of each step.
    scale : (n,) array
        Sizes of the coordinates.
    difference : float
        Largest scaled difference between the steps of the two halves that count as equal.
    """
    if len(orbit) % 2:
        return False
    one, other = np.split(np.asarray(orbit), 2)
    return bool(np.max(np.abs((one - other) / scale)) < difference)
