"""Branches followed point by point, with every special point on the way."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.continuation.branch_diagram import name_missing_gait
from gaitopt.continuation.location import Describe, describe_change, smooth_special_points, structure_brackets
from gaitopt.continuation.map_family import MapSample
from gaitopt.continuation.pseudo_arclength import CurvePoint, Stepper
from gaitopt.continuation.roll_over import locate_roll_over
from gaitopt.continuation.special_point import STOP_KINDS, SpecialKind, SpecialPoint
from gaitopt.motion.motion import Array

LOOK_AHEAD = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
"""Scaled distances beyond the last point at which the structure on the other side of a boundary is sought."""
DEPARTURES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Scaled distances from a boundary at which the branch on its other side is sought."""

SHORTEST_INTERVAL = 1e-6
"""Scaled distance of consecutive points of a branch; the steps towards an end become much shorter."""
LARGEST_MULTIPLIER = 3.0
"""Modulus of a multiplier below which the derivative with respect to the parameter is used at the next point, too."""
LOCATED = 1e-6
"""Scaled distance of the neighbours of a change of structure that counts as located."""
SLOW = "no_touchdown"
"""Reason for which a step that takes too long stops."""
LARGEST_RELIABLE_MULTIPLIER = 1e4
"""Modulus of a multiplier above which a branch ends if rounding errors of the residual exceed the tolerance, too: they
decide all further steps."""

Continues = Callable[[MapSample, MapSample], bool]
"""Whether a branch continues after a change from one structure to another."""


class FollowingWork(NamedTuple):
    """Work that begins while a branch is followed.

    Attributes
    ----------
    name : str
        Such as ``"locating a fold"``; empty for a step.
    value : float
        Parameter of the last gait.
    arclength : float
        Scaled arclength from the first gait to the last one.
    """

    name: str
    value: float
    arclength: float


WorkObserver = Callable[[FollowingWork], None]


class BranchFollower:
    """Follows a branch to the end of a range of the parameter, or to its own end.

    Parameters
    ----------
    stepper : Stepper
    ends : (float, float)
        Range of the parameter.
    name : callable
        Names the structure of a sample.
    continues : callable, optional
        Whether a branch continues after a change between two structures.
    work_observer : callable, optional
        Called with each step and each location of a special point that begins.

    Attributes
    ----------
    end : str
        Reason for which the branch ends, when it has been followed.
    beyond : CurvePoint or None
        Point on the other side of the change at which a branch ends because its gaits continue as another family.
    """

    def __init__(
        self,
        stepper: Stepper,
        ends: tuple[float, float],
        name: Describe,
        *,
        continues: Continues | None = None,
        work_observer: WorkObserver | None = None,
    ) -> None:
        self.stepper, self.name = stepper, name
        self._work_observer, self._length = work_observer, 0.0
        self.continues = continues or (lambda before, after: True)
        self.low, self.high = min(ends), max(ends)
        self.end = ""
        self.beyond: CurvePoint | None = None
        self._bend = np.zeros(stepper.scales.size)
        self._brackets = list[tuple[CurvePoint, CurvePoint]]()

    def follow(self, start: CurvePoint) -> Iterator[CurvePoint | SpecialPoint]:
        """Yield points and special points in order, `start` first."""
        options = self.stepper.options
        point, shown, step = start, start, options.first_step
        yield point
        for _ in range(options.most_points):
            self._observe_work("", point.value)
            following, step = self._advance(point, step)
            if following is None:
                crossing = self._cross(point)
                special, following = crossing if isinstance(crossing, tuple) else (crossing, None)
                if following is None:
                    # The derivative is singular at some ends, so that multipliers are inaccurate close to them.
                    yield replace(special, multipliers_before=shown.multipliers)
                    self.end = special.kind.key if special.kind is not SpecialKind.END else special.after
                    return
                yield special
                step = options.first_step / 10
            else:
                outside = not self.low <= following.value <= self.high
                if outside:
                    following = self._land(point, following)
                    if following is None:
                        self.end = "range_end"
                        return
                specials, following, last = self._specials(point, following)
                yield from specials
                if last is not None:
                    self.end = last.kind.key
                    return
                if outside:
                    yield following
                    self.end = "range_end"
                    return
            same = following.sample.structure == shown.sample.structure
            if not same or self._distance(shown, following) >= SHORTEST_INTERVAL:
                yield following
                shown = following
            if self._is_unresolved(following):
                size = float(np.max(np.abs(following.multipliers)))
                yield self._end(following, SpecialKind.UNBOUNDED_MULTIPLIER, f"a multiplier of {size:.1e}")
                self.end = SpecialKind.UNBOUNDED_MULTIPLIER.key
                return
            self._length += self._distance(point, following)
            self._bend = self.stepper.bend(point, following)
            point = following
        self.end = "most_points"

    def _observe_work(self, name: str, value: float) -> None:
        if self._work_observer is not None:
            self._work_observer(FollowingWork(name, value, self._length))

    def _advance(self, point: CurvePoint, step: float) -> tuple[CurvePoint | None, float]:
        """Return the next point and the step after it; None if the corrector fails for the shortest step."""
        stepper, options = self.stepper, self.stepper.options
        # The errors of Newton's method with the derivative of a point nearby grow with the multipliers.
        modest = float(np.max(np.abs(point.multipliers), initial=0.0)) < LARGEST_MULTIPLIER
        by_value = point.derivative[:, -1] if modest else None
        while step >= options.shortest_step:
            following = stepper.correct(stepper.predict(point, step, self._bend), point.tangent, by_value)
            if following is not None and self._is_neighbour(point, following, step):
                return following, stepper.adapt(step, point, following)
            step /= 2
            self._observe_work(f"step shortened to {step:.1e}", point.value)
        return None, step

    def _is_unresolved(self, point: CurvePoint) -> bool:
        """Return whether the multipliers are so large that rounding errors decide the direction of the branch."""
        residual = point.sample.residual
        if residual is None or float(np.max(np.abs(point.multipliers), initial=0.0)) < LARGEST_RELIABLE_MULTIPLIER:
            return False
        return float(np.max(np.abs(residual / self.stepper.family.scale))) > self.stepper.options.tolerance

    def _is_neighbour(self, point: CurvePoint, following: CurvePoint, step: float) -> bool:
        """Return whether a point lies on the same branch: near the prediction, without a sharp turn in one piece."""
        distance = self._distance(point, following)
        self._brackets = []
        if following.sample.structure != point.sample.structure:
            if distance > 3 * step:
                return False

            def observe(distance: float) -> None:
                self._observe_work(f"locating a change of the contact sequence, within {distance:.0e}", point.value)

            self._brackets = structure_brackets(self.stepper, point, following, observe)
            # Between points of two branches no change can be located.
            return bool(self._brackets) and all(self._distance(*pair) <= LOCATED for pair in self._brackets)
        return distance <= 1.5 * step and self.stepper.angle(point, following) <= self.stepper.options.largest_angle

    def _find_brackets(self, point: CurvePoint, following: CurvePoint) -> list[tuple[CurvePoint, CurvePoint]]:
        """Return the changes of structure between two points, the second one perhaps at the end of the range."""
        if self._brackets and self._brackets[-1][1].sample.structure == following.sample.structure:
            last = self._brackets[-1][1]
            if self._distance(point, last) <= self._distance(point, following):
                return self._brackets
        return structure_brackets(self.stepper, point, following)

    def _distance(self, one: CurvePoint, other: CurvePoint) -> float:
        return float(np.linalg.norm(self.stepper.position(other) - self.stepper.position(one)))

    def _land(self, point: CurvePoint, following: CurvePoint) -> CurvePoint | None:
        """Return the point at the end of the range that a step has passed."""
        limit = self.low if following.value < self.low else self.high
        start, end = self.stepper.position(point), self.stepper.position(following)
        if point.value == limit or start[-1] == end[-1]:
            return None
        share = (limit - point.value) / (following.value - point.value)
        normal = np.zeros(start.size)
        normal[-1] = math.copysign(1.0, following.value - point.value)
        return self.stepper.correct(start + share * (end - start), normal)

    def _specials(
        self, point: CurvePoint, following: CurvePoint
    ) -> tuple[list[CurvePoint | SpecialPoint], CurvePoint, SpecialPoint | None]:
        """Return the special points between two points, and the second one with its tangent leading away from them.

        If the branch ends at one of them, this one is returned as well, and the last point before it is in the list.
        """
        stepper, specials = self.stepper, list[CurvePoint | SpecialPoint]()
        latest = point
        for near, far in self._find_brackets(point, following):
            specials += self._locate(latest, near) if near is not latest else []
            change = describe_change(stepper, near, far, self.name)
            if not self.continues(near.sample, far.sample):
                self.beyond = far
                return [*specials, *([near] if near is not point else []), change], following, change
            specials += [*([near] if near is not point else []), change, *([far] if far is not following else [])]
            latest = far
        if latest is not point and latest is not following:
            away = stepper.position(following) - stepper.position(latest)
            if away @ following.tangent < 0:
                following = replace(following, tangent=-following.tangent)
            if away @ latest.tangent < 0:
                latest = replace(latest, tangent=-latest.tangent)
        if latest is not following:
            specials += self._locate(latest, following)
        return specials, following, None

    def _locate(self, one: CurvePoint, other: CurvePoint) -> list[CurvePoint | SpecialPoint]:
        """Return the bifurcations between two points of the same structure."""

        def observe(kind: SpecialKind, value: float) -> None:
            self._observe_work(f"locating a special point ({kind.label})", value)

        return smooth_special_points(self.stepper, one, other, self.name, observe)

    def _cross(self, point: CurvePoint) -> SpecialPoint | tuple[SpecialPoint, CurvePoint]:
        """Return the end of the branch, or the boundary to another structure with the first point beyond it."""
        family, size = self.stepper.family, self.stepper.family.size
        reason = "no convergence"
        self._observe_work("seeking gaits beyond the end of the sequence", point.value)
        for x in self._look_ahead(point):
            sample = family.evaluate(x[:size], float(x[size]))
            if sample.residual is None:
                reason = str(sample.structure)
                if reason == SLOW:
                    continue  # close to the boundary a step takes long, whatever ends it beyond
                break
            if sample.structure != point.sample.structure:
                z, value = family.after_change(x[:size], sample), float(x[size])
                following = family.evaluate(z, value)
                beyond = None if following.residual is None else self._depart(point, z, value, following)
                if beyond is not None and self.continues(point.sample, beyond.sample):
                    change = describe_change(self.stepper, point, beyond, self.name)
                    return replace(change, value=point.value, z=point.z, width=self._width(point)), beyond
                kind = family.classify(point.sample, sample)
                return self._end(point, kind, name_missing_gait(self.name(sample.structure)))
        end = self._end(point, STOP_KINDS.get(reason, SpecialKind.END), reason)
        return locate_roll_over(self.stepper, point, end) if end.kind is SpecialKind.ROLL_OVER else end

    def _look_ahead(self, point: CurvePoint) -> Iterator[Array]:
        """Yield (z, value) at growing distances along the tangent, and on both sides in the parameter alone."""
        axis = np.eye(self.stepper.scales.size)[-1] * np.copysign(1.0, point.tangent[-1])
        for distance in LOOK_AHEAD:
            for direction in (point.tangent, axis, -axis):
                yield (self.stepper.position(point) + distance * direction) * self.stepper.scales

    def _depart(self, point: CurvePoint, z: Array, value: float, sample: MapSample) -> CurvePoint | None:
        """Return a point of the branch with another structure that begins at the boundary where a branch ends.

        Parameters
        ----------
        point : CurvePoint
            Last point before the boundary.
        z : (n,) array
            Point of the section beyond it.
        value : float
        sample : MapSample
            The map at `z`.
        """
        stepper = self.stepper
        derivative = stepper.family.derivative(z, value, sample)
        if not np.all(np.isfinite(derivative)):
            return None
        tangent = np.linalg.svd(derivative * stepper.scales / stepper.family.scale[:, None])[2][-1]
        start = stepper.position(point)
        for distance in DEPARTURES:
            for sign in (1, -1):
                beyond = stepper.correct(start + sign * distance * tangent, sign * tangent)
                if beyond is None or beyond.sample.structure == point.sample.structure:
                    continue
                if float(np.linalg.norm(stepper.position(beyond) - start)) <= 10 * distance:
                    return beyond
        return None

    def _end(self, point: CurvePoint, kind: SpecialKind, reason: str) -> SpecialPoint:
        return SpecialPoint(
            kind=kind,
            value=point.value,
            width=self._width(point),
            z=point.z,
            before=self.name(point.sample.structure),
            after=reason,
            multipliers_before=point.multipliers,
            multipliers_after=np.array([], dtype=complex),
        )

    def _width(self, point: CurvePoint) -> float:
        """Return the width to which the end of the branch at its last point is located."""
        reach = self.stepper.options.shortest_step * abs(float(point.tangent[-1])) * self.stepper.family.value_scale
        return max(2 * reach, 1e-16)
