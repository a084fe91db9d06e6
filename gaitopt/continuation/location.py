"""Location of special points between two points of a branch."""

import functools
import math
from collections.abc import Callable, Iterator

import numpy as np
from scipy.optimize import brentq

from gaitopt.continuation.pseudo_arclength import CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst

WIDTH = 1e-10
"""Width of the interval to which changes of structure are located, in the unit of the parameter."""
CHORD = 3e-10
"""Scaled distance to which they are located, which counts at a fold, where the parameter hardly changes."""
SHORTEST_CHORD = 1e-13
"""Scaled distance of two points below which the interval between them is not divided further."""
SHORTEST_PIECE = 1e-7
"""Scaled distance of two points below which no bifurcation is sought between them."""
SAME_BRANCH = 1e-5
"""Scaled distance of two branches that pass each other below which they cross, within rounding errors."""
LARGEST_WIDTH = 1e-6
"""Width, relative to the range of the parameter, above which the zero of a test function is no bifurcation."""
STEEPEST = 0.05
"""Smallest cosine between a chord and a tangent along which a point between is predicted."""
SAME_SLOPE = (1e-8, 1e-3)
"""Least and largest scaled distance of two points for which the derivative of the map with respect to the parameter is
taken from one of them; otherwise it is evaluated at each iterate."""
MODEST = 3.0
"""Largest modulus of a multiplier for which this is done: errors of the derivative grow with the multipliers."""
MOST_BISECTIONS = 100
"""Largest number of bisections of an interval.  About 50 reach the smallest distance, unless middle points lie on
another branch, so that the distance does not decrease."""
LEAST_DECREASE, STALL = 0.95, 20
"""Ratio of the lengths of an interval and of its half above which it has hardly decreased, and the number of bisections
that this counts for."""
Describe = Callable[[object], str]
"""Names the structure of a sample."""
Test = Callable[[CurvePoint], float]
DistanceObserver = Callable[[float], None]
KindObserver = Callable[[SpecialKind, float], None]


class LocationError(Exception):
    """The corrector fails between two points of a branch."""


def point_between(stepper: Stepper, one: CurvePoint, other: CurvePoint, share: float) -> CurvePoint:
    """Return the branch point in the plane across the chord between two points, at a share of its length.

    Raises
    ------
    LocationError
        If the corrector fails there.
    """
    start, end = stepper.position(one), stepper.position(other)
    chord = end - start
    normal = chord / np.linalg.norm(chord)
    plane = start + share * chord
    # At a kink, Newton's method converges from the prediction on the side on which the point lies.
    sides = [(start, one.tangent), (end, other.tangent)]
    multipliers = np.concatenate([one.multipliers, other.multipliers])
    close = SAME_SLOPE[0] < float(np.linalg.norm(chord)) < SAME_SLOPE[1] and worst(np.abs(multipliers), 0.0) < MODEST
    near = (one, other) if close else ()
    for origin, tangent in [(plane, normal), *(sides if share < 0.5 else sides[::-1])]:
        slope = float(normal @ tangent)
        if abs(slope) < STEEPEST:
            continue
        point = stepper.correct(origin + float(normal @ (plane - origin)) / slope * tangent, normal, near=near)
        if point is not None:
            return point
    raise LocationError


def structure_brackets(
    stepper: Stepper, one: CurvePoint, other: CurvePoint, observer: DistanceObserver | None = None
) -> list[tuple[CurvePoint, CurvePoint]]:
    """Return neighbours of different structure between two points, as close to each other as `WIDTH`, in order.

    Changes that are not separated by more than this are one change: events coincide there.  The observer is called with
    the scaled distance of the points of each interval that is divided.
    """
    merged = list[tuple[CurvePoint, CurvePoint]]()
    for near, far in _brackets(stepper, one, other, observer):
        if merged:
            gap = stepper.position(near) - stepper.position(merged[-1][1])
            if float(np.linalg.norm(gap)) <= 1e3 * WIDTH:
                merged[-1] = (merged[-1][0], far)
                continue
        merged.append((near, far))
    return [(near, far) for near, far in merged if near.sample.structure != far.sample.structure]


def _brackets(
    stepper: Stepper,
    one: CurvePoint,
    other: CurvePoint,
    observer: DistanceObserver | None,
    left: int = MOST_BISECTIONS,
) -> Iterator[tuple[CurvePoint, CurvePoint]]:
    """Yield neighbours of different structure; those that `left` bisections do not bring together are not located."""
    if one.sample.structure == other.sample.structure:
        return
    distance = float(np.linalg.norm(stepper.position(other) - stepper.position(one)))
    if (abs(other.value - one.value) <= WIDTH and distance <= CHORD) or distance <= SHORTEST_CHORD:
        yield one, other
        return
    if observer is not None:
        observer(distance)
    try:
        middle = point_between(stepper, one, other, 0.5) if left else None
    except LocationError:
        middle = None
    if middle is None:
        yield one, other
        return
    for near, far in ((one, middle), (middle, other)):
        shrinks = float(np.linalg.norm(stepper.position(far) - stepper.position(near))) < LEAST_DECREASE * distance
        yield from _brackets(stepper, near, far, observer, left - 1 if shrinks else max(left - STALL, 0))


def describe_change(stepper: Stepper, one: CurvePoint, other: CurvePoint, name: Describe) -> SpecialPoint:
    """Return the special point between two neighbours of different structure."""
    return SpecialPoint(
        kind=stepper.family.classify(one.sample, other.sample),
        value=(one.value + other.value) / 2,
        width=abs(other.value - one.value),
        z=(one.z + other.z) / 2,
        before=name(one.sample.structure),
        after=name(other.sample.structure),
        multipliers_before=one.multipliers,
        multipliers_after=other.multipliers,
    )


def locate_zero(stepper: Stepper, one: CurvePoint, other: CurvePoint, test: Test) -> tuple[CurvePoint, float] | None:
    """Return the point between two points at which a test function is zero, and the width of its location.

    Parameters
    ----------
    stepper : Stepper
    one, other : CurvePoint
        Points of the same structure, at which the test function has different signs.
    test : callable

    Returns
    -------
    (CurvePoint, float) or None
        None if the corrector fails in between, or the points on both sides of the zero lie on different branches.
    """
    length = float(np.linalg.norm(stepper.position(other) - stepper.position(one)))
    sides = {test(one) > 0: (0.0, one), test(other) > 0: (1.0, other)}

    def evaluate(share: float) -> float:
        if share in (0.0, 1.0):
            return test(other if share else one)
        point = point_between(stepper, one, other, share)
        value = test(point)
        sides[value > 0] = share, point
        (low, before), (high, after) = sides[True], sides[False]
        gap = float(np.linalg.norm(stepper.position(after) - stepper.position(before)))
        if gap > max(SAME_BRANCH, abs(high - low) * length / STEEPEST):
            raise LocationError  # a branch point that is imperfect: two branches pass each other
        return value

    try:
        share = brentq(evaluate, 0.0, 1.0, xtol=1e-14, rtol=1e-14)
        point = point_between(stepper, one, other, share)
        near = point_between(stepper, one, other, share + math.copysign(1e-9, 0.5 - share))
    except LocationError:
        return None
    slope = abs(test(near) - test(point)) / 1e-9
    error = abs(test(point)) / slope if slope else 1e-14
    return point, max(error * abs(near.value - point.value) / 1e-9, 1e-16)


def smooth_special_points(
    stepper: Stepper, one: CurvePoint, other: CurvePoint, name: Describe, observer: KindObserver | None = None
) -> list[CurvePoint | SpecialPoint]:
    """Return the bifurcations between two points of the same structure in order, each after its point.

    The observer is called with each kind that is located, and the parameter of the first point.
    """
    bifurcations = list[tuple[float, CurvePoint, SpecialPoint]]()
    if float(np.linalg.norm(stepper.position(other) - stepper.position(one))) <= SHORTEST_PIECE:
        return []  # rounding errors decide the signs of the test functions
    for kind, test in _crossed_tests(stepper, one, other):
        if observer is not None:
            observer(kind, one.value)
        located = locate_zero(stepper, one, other, test)
        if located is None:
            continue
        point, width = located
        if width > LARGEST_WIDTH * stepper.family.value_scale:
            continue  # the test function jumps, as it does where a derivative is singular
        distance = float(np.linalg.norm(stepper.position(point) - stepper.position(one)))
        special = SpecialPoint(
            kind=kind,
            value=point.value,
            width=width,
            z=point.z,
            before=name(point.sample.structure),
            after=name(point.sample.structure),
            multipliers_before=point.multipliers,
            multipliers_after=point.multipliers,
            test=test(point),
            direction=_direction(stepper, point, kind),
        )
        bifurcations.append((distance, point, special))
    ordered = sorted(bifurcations, key=lambda each: each[0])
    return [item for _, point, special in ordered for item in (point, special)]


def _crossed_tests(stepper: Stepper, one: CurvePoint, other: CurvePoint) -> Iterator[tuple[SpecialKind, Test]]:
    """Yield the test functions that change their sign between two points, with the kind of their zeros."""
    turn = one.tangent[-1] * other.tangent[-1] < 0
    if turn:
        yield SpecialKind.FOLD, lambda point: float(point.tangent[-1])
    elif _fixed_points(one) * _fixed_points(other) < 0:
        yield SpecialKind.BRANCH_POINT, _fixed_points
    if _flips(one) * _flips(other) < 0:
        yield SpecialKind.PERIOD_DOUBLING, _flips
    if _pairs(one) * _pairs(other) < 0:
        yield SpecialKind.NEIMARK_SACKER, _pairs
    measures = stepper.family.measures
    values = [measures(point.z, point.value, point.sample) for point in (one, other)]
    for key in values[0].keys() & values[1].keys():
        if values[0][key] * values[1][key] < 0:
            yield SpecialKind[key.upper()], functools.partial(_measure, measures, key)


def _measure(measures: Callable[..., dict[str, float]], key: str, point: CurvePoint) -> float:
    return measures(point.z, point.value, point.sample)[key]


def _fixed_points(point: CurvePoint) -> float:
    """Return the product of 1 - multiplier, zero at folds and branch points."""
    return float(np.prod(1 - point.multipliers).real)


def _flips(point: CurvePoint) -> float:
    """Return the product of 1 + multiplier, zero at period doublings."""
    return float(np.prod(1 + point.multipliers).real)


def _pairs(point: CurvePoint) -> float:
    """Return the largest modulus of a complex multiplier minus 1, nan without one; zero at Neimark-Sacker points."""
    moduli = np.abs(point.multipliers[np.abs(point.multipliers.imag) > 0])
    return float(moduli.max() - 1) if moduli.size else math.nan


def _direction(stepper: Stepper, point: CurvePoint, kind: SpecialKind) -> Array | None:
    """Return the eigenvector of the critical multiplier in scaled coordinates, of length 1."""
    critical = {SpecialKind.PERIOD_DOUBLING: -1.0, SpecialKind.BRANCH_POINT: 1.0}.get(kind)
    if critical is None:
        return None
    scale = stepper.family.scale
    matrix = point.derivative[:, :-1] * scale / scale[:, None] + np.eye(scale.size)
    values, vectors = np.linalg.eig(matrix)
    vector = vectors[:, np.argmin(np.abs(values - critical))].real
    return np.asarray(vector / np.linalg.norm(vector))
