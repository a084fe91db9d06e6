"""Points of codimension two, at which a curve of special points meets a curve of another kind.

The curve is sampled on one side of the point.  The other curve, which bounds the same gaits, is sampled along parallels
to the tangent.  Both are smooth up to the point, so it is the intersection of their interpolating polynomials.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from gaitopt.continuation.gait_family import name_structure
from gaitopt.continuation.line_search import LineSearch, PlanePoint
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.motion.motion import Array

SAMPLES = 3
"""Number of samples of each curve."""
DEPTHS = (0.05, 0.004)
"""Distances of the parallels from the tangent, relative to the distance between samples of the curve, in order."""
REDUCTION = 0.2
"""Ratio of the distances between samples at successive locations."""
BEHIND, BEYOND = 8.0, 4.0
"""Ends of the search for the other curve, relative to the distance between samples."""
SAME_POINT = 1e-5
"""Largest distance between the last two locations."""
PARALLEL = 1e-5
"""Difference of two slopes below which curves are regarded as parallel."""


class Meeting(NamedTuple):
    """A point of codimension two, and a special point of the other curve next to it."""

    point: PlanePoint
    other: SpecialPoint


def locate_meeting(search: LineSearch, last: PlanePoint, tangent: Array, step: float, finest: float) -> Meeting | None:
    """Return the point of codimension two at which a curve ends, or None if none is found.

    Parameters
    ----------
    search : LineSearch
    last : PlanePoint
        Last point of the curve.
    tangent : (2,) array
        Unit vector towards the end.
    step : float
        Distance from the last point within which the curve ends.
    finest : float
        Distance between samples at the last location.
    """
    meeting, base = _intersect(search, last, last.place, tangent, step), last.place
    while meeting is not None and step > finest:
        step, before = max(REDUCTION * step, finest), meeting.point
        meeting = _intersect(search, before, before.place - step * tangent, tangent, step)
        if meeting is not None and step == finest and not _agree(before, meeting.point):
            return None
    return meeting if meeting is None or tangent @ (meeting.point.place - base) > 0 else None


def _intersect(search: LineSearch, last: PlanePoint, base: Array, tangent: Array, step: float) -> Meeting | None:
    """Return the intersection of a curve behind a place and the next curve that bounds the gaits before it."""
    normal, along = last.across(tangent), [-k * step for k in range(SAMPLES)]
    points = _sample(search, last, [base + s * tangent for s in along], normal, step)
    if points is None:
        return None
    curve = _fit(along, [float(normal @ (point.place - base)) for point in points])
    for depth in DEPTHS:
        offsets = [-k * depth * step for k in range(1, SAMPLES + 1)]
        places = [base + offset * normal for offset in offsets]
        bounds = [_find_bound(search, points[0], place, tangent, step) for place in places]
        ends = [special for special in bounds if special is not None]
        if len(ends) < len(bounds) or len({special.kind for special in ends}) > 1:
            continue
        bound = _fit(offsets, [special.value for special in ends])
        end = _find_root(bound(curve) - Polynomial([0.0, 1.0]), float(bound(0.0)))
        if end is not None and -step <= end <= BEYOND * step:
            place = base + end * tangent + curve(end) * normal
            return Meeting(_move(points, along, place, end), ends[0])
    return None


def _find_bound(
    search: LineSearch, point: PlanePoint, place: Array, tangent: Array, step: float
) -> SpecialPoint | None:
    """Return the end of the gaits before a special point on a parallel to the curve."""
    family = search.on_line(place, tangent, BEHIND * step)
    for behind in (BEHIND, BEHIND / 4):
        located = search.first_special(family, point.near, (-behind * step, BEYOND * step))
        if located is None or name_structure(located[0].sample.structure) != point.special.before:
            continue
        special = located[2]
        same = special.kind is point.special.kind and special.after == point.special.after
        return None if same else special
    return None


def locate_corner(search: LineSearch, last: PlanePoint, following: PlanePoint, step: float) -> PlanePoint | None:
    """Return the point between two points of a curve at which two smooth curves form a corner, or None.

    The sequence after the special point differs on both sides of it.

    Parameters
    ----------
    search : LineSearch
    last, following : PlanePoint
    step : float
        Distance between the points from which the corner is located.
    """
    while last.special.after != following.special.after:
        move = following.place - last.place
        length = float(np.linalg.norm(move))
        tangent = move / length
        if length <= step:
            first = _intersect_sides(search, last, following, tangent, length)
            if first is None:
                return None
            last, following = (replace(first, special=each.special, near=each.near) for each in (last, following))
            refined = _intersect_sides(search, last, following, tangent, REDUCTION * step)
            return refined if refined is not None and _agree(first, refined) else None
        middle = search.locate(last, (last.place + following.place) / 2, last.across(tangent), length / 2)
        if isinstance(middle, str):
            return None
        last, following = (middle, following) if middle.special.after == last.special.after else (last, middle)
    return None


def _intersect_sides(
    search: LineSearch, last: PlanePoint, following: PlanePoint, tangent: Array, step: float
) -> PlanePoint | None:
    """Return the intersection of a curve behind one point and a curve beyond another one."""
    normal, base = last.across(tangent), last.place
    shift = max(float(tangent @ (following.place - base)), step)
    sides = list[tuple[list[PlanePoint], list[float]]]()
    for point, along in (
        (last, [-k * step for k in range(1, SAMPLES + 1)]),
        (following, [shift + k * step for k in range(SAMPLES)]),
    ):
        points = _sample(search, point, [base + s * tangent for s in along], normal, step)
        if points is None or any(each.special.after != point.special.after for each in points):
            return None
        sides.append((points, along))
    one, other = (_fit(along, [float(normal @ (point.place - base)) for point in points]) for points, along in sides)
    difference = other - one
    if abs(difference.deriv()(0.0)) < PARALLEL:
        return None
    end = _find_root(difference, 0.0)
    if end is None or abs(end) > BEYOND * step:
        return None
    return _move(*sides[0], base + end * tangent + one(end) * normal, end)


def _sample(
    search: LineSearch, last: PlanePoint, places: Iterable[Array], normal: Array, step: float
) -> list[PlanePoint] | None:
    """Return the points of a curve on parallel lines, or None if one is not found."""
    points = list[PlanePoint]()
    for place in places:
        point = search.locate(points[-1] if points else last, place, normal, step)
        if isinstance(point, str):
            return None
        points.append(point)
    return points


def _fit(arguments: list[float], values: list[float]) -> Polynomial:
    """Return the interpolating polynomial of some samples."""
    return Polynomial.fit(arguments, values, len(values) - 1).convert()


def _find_root(polynomial: Polynomial, start: float) -> float | None:
    """Return the root of a polynomial to which Newton's method converges, or None."""
    value, slope = start, polynomial.deriv()
    for _ in range(50):
        step = float(polynomial(value) / slope(value)) if slope(value) else np.inf
        if abs(step) <= 1e-14:
            return value - step
        value -= step
    return None


def _agree(one: PlanePoint, other: PlanePoint) -> bool:
    return float(np.linalg.norm(one.place - other.place)) <= SAME_POINT


def _move(points: list[PlanePoint], along: list[float], place: Array, end: float) -> PlanePoint:
    """Return the first of some points of a curve, moved to a place, with the extrapolated state."""
    states = np.array([point.special.z for point in points])
    z = np.array([_fit(along, column.tolist())(end) for column in states.T])
    return replace(points[0], place=place, special=replace(points[0].special, z=z))
