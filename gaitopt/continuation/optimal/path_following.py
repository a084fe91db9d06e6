"""Continuation of the optimality conditions over a parameter, with exact changes of the active set.

Between changes of the active set the optimum is a smooth curve of parameter, unknowns and multipliers.  The predictor
follows its tangent, and Newton's method corrects; at requested values of the parameter within a step, the optimum is
interpolated and corrected.  If a slack or a multiplier has become negative, its zero is located by Newton's method on
the conditions extended by this equation; the constraint then enters or leaves the active set, and the curve continues
with it (Guddat, Guerra Vazquez & Jongen, Parametric Optimization: Singularities, Pathfollowing and
Jumps, 1990, chapter 2).  If optimal torques are zero over intervals, several constraints change together, and a solve
from the point of the change determines the active set beyond it.  At a fold the reduced Hessian is singular and the
parameter turns back.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gaitopt.continuation.optimal.active_set_search import DISTANCES, find_optimum_beyond, solve_nearby
from gaitopt.continuation.optimal.kkt_correction import (
    Metric,
    at_distance,
    at_value,
    at_zero_margin,
    correct,
    find_tangent,
)
from gaitopt.continuation.optimal.kkt_point import KktLinearisation, KktPoint
from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.continuation.optimal.path_items import PathChange, PathKind, PathOptions, PathPoint
from gaitopt.continuation.optimal.sample_interpolation import PieceInterpolation
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst

VIOLATED = -1e-9
"""Margin below which a constraint is violated, or a multiplier has the wrong sign, within rounding errors."""

SHORTEST_PIECE = 2e-3
"""Step, relative to the range, below which an optimum of an objective with kinks is found by a solve."""

SAME_OPTIMUM = 0.1
"""Largest scaled change of an unknown when the sign changes of the joint powers are located again."""

SAME_PLACE = 1e-11
"""Distance, relative to the range, of changes of the active set at the same value of the parameter."""

SAME_POINT = 1e-3
"""Distance of two points, relative to the step, at which a margin has the same zero."""

MOST_SWITCHES = 12
"""Largest number of changes of the active set at the same value of the parameter."""

MOST_CANDIDATES = 12
"""Largest number of constraints tried as the first one that changes in a step."""


LARGE_MULTIPLIER = 1e5
"""Scaled multiplier at an end beyond which no gait satisfies the constraints: multipliers tend to infinity there."""

FEASIBILITY_LIMIT = "feasibility_limit"
"""End of a curve beyond which no gait satisfies the constraints."""


class PathFollower:
    """Follower of one curve of optima in one direction.

    Parameters
    ----------
    nlp : ParametricNlp
    options : PathOptions
    samples : sequence of float
        Values of the parameter at which points are requested; the smallest and the largest end the branch.

    Attributes
    ----------
    end : str
        Reason for which the curve ends.
    """

    def __init__(self, nlp: ParametricNlp, options: PathOptions, samples: Sequence[float]) -> None:
        self.nlp, self.options, self.metric = nlp, options, Metric(nlp)
        self.samples, self.end = np.array(sorted(samples)), "interrupted"
        self._switches, self._last_change = 0, math.nan
        self._switched: tuple[KktLinearisation | None, set[int]] = (None, set())
        self._smooth = nlp.transcription.nlp.smooth

    def follow(self, start: KktLinearisation, direction: float) -> Iterator[PathPoint | PathChange]:
        """Yield points and special points in order, from an optimum towards larger or smaller values."""
        packed, last = find_tangent(start, self.metric)
        sign = math.copysign(1.0, direction * last)
        point, step = PathPoint(start, (sign * packed, sign * last), sampled=True), self.options.first_step
        yield point
        for _ in range(self.options.most_points):
            if self._is_at_end(point):
                self.end = "range_end"
                return
            passed, following, step = self._advance(point, step)
            if following is None and step >= (self.options.shortest_step if self._smooth else SHORTEST_PIECE):
                continue
            if following is None:
                after = None if self._smooth else self._restart(point, point.optimum, distances=(1.0, *DISTANCES))
                if after is None:
                    large = worst(np.abs(point.optimum.point.multipliers)) > LARGE_MULTIPLIER
                    self.end = FEASIBILITY_LIMIT if large else "no_convergence"
                    yield point
                    return
                following, step = after, self.options.first_step
            yield from passed
            if isinstance(following, PathPoint):
                turning = self._locate_turning_point(point, following) if self._smooth else None
                if turning is not None:
                    yield turning
                point = following if self._smooth or not following.sampled else self._solve_again(following)
                yield point
                continue
            items, after = self._continue_after(following, point)
            yield from items
            if after is None:
                return
            point = after
        self.end = "most_points"

    def _continue_after(
        self, change: PathChange, point: PathPoint
    ) -> tuple[list[PathChange | PathPoint], PathPoint | None]:
        """Return the items that follow a change on the curve, and the point from which the curve continues or None."""
        items: list[PathChange | PathPoint]
        if not self._smooth:
            after = self._restart(point, change.optimum)
            same = after is not None and np.array_equal(after.optimum.active.sides, point.optimum.active.sides)
            items = [] if same else [change]  # multipliers that are not unique may vanish without a change
            return [*items, *([after] if after is not None and after.sampled else [])], after
        after, implied = self._switch(change)
        turns = after is not None and after.tangent[1] * point.tangent[1] < 0
        items = [replace(change, turns=turns and implied is None)]
        return [*items, *([] if implied is None else [replace(implied, turns=turns)])], after

    def _is_at_end(self, point: PathPoint) -> bool:
        slack = 1e-13 * self.nlp.width
        if point.tangent[1] > 0:
            return point.value >= self.samples[-1] - slack
        return point.value <= self.samples[0] + slack

    def _advance(
        self, point: PathPoint, step: float
    ) -> tuple[Sequence[PathPoint], PathPoint | PathChange | None, float]:
        """Return the samples that a step passes, the point or change of the active set it leads to, and the next step.

        If the samples cannot be interpolated, the step ends at the first one; a step that is too long leads to None.
        """
        samples = self._samples_ahead(point)
        reached = samples[np.abs(samples - point.value) <= step * abs(point.tangent[1])]
        targets = [*reached[-1:], *reached[:1]] if self._smooth else [*reached[:1]]
        for target in dict.fromkeys(targets or [None]):
            following = self._take_step(point, step, target)
            filled = None if following is None else self._fill(point, following, samples)
            if filled is not None:
                return *filled, min(1.5 * step, self.options.longest_step)
            step *= 0.5
        return (), None, step

    def _take_step(self, point: PathPoint, step: float, sample: float | None) -> PathPoint | PathChange | None:
        """Return the point at a sample, or at a step along the tangent, or the first change of the active set before.

        None if the step is too long.
        """
        packed, last = point.tangent
        step = step if sample is None else (sample - point.value) / last
        predicted = point.optimum.move(step * packed, point.value + step * last if sample is None else sample)
        ahead = KktLinearisation(self.nlp, predicted, point.optimum.active)
        change = self._locate_change(point.optimum, ahead) if np.any(ahead.margins < VIOLATED) else None
        if change is not None:
            return change
        condition = at_distance(self.metric, point.tangent, predicted) if sample is None else at_value(sample)
        optimum = correct(self.nlp, predicted, point.optimum.active, condition, point.optimum)
        if optimum is None:
            return None
        if np.any(optimum.margins < VIOLATED):
            return self._locate_change(point.optimum, optimum)
        tangent = find_tangent(optimum, self.metric, point.tangent)
        if not math.isfinite(tangent[1]) or self._angle(optimum, tangent, point.tangent) > self.options.largest_angle:
            return None
        return PathPoint(optimum, tangent, sample is not None)

    def _fill(
        self, point: PathPoint, following: PathPoint | PathChange, samples: Array
    ) -> tuple[Sequence[PathPoint], PathPoint | PathChange] | None:
        """Return the samples between two points, and what follows them; None if they cannot be interpolated.

        A constraint that is violated at a sample changes before it.
        """
        before, after = point.optimum, following.optimum
        slack = 1e-12 * self.nlp.width
        distances = (after.point.value - samples) * math.copysign(1.0, point.tangent[1])
        passed, last = list[PathPoint](), list[PathPoint]()
        for sample in samples[np.abs(distances) <= slack].tolist() if isinstance(following, PathChange) else ():
            at_sample = KktLinearisation(self.nlp, replace(after.point, value=sample), after.active)
            last.append(PathPoint(at_sample, point.tangent, sampled=True))
        samples = samples[distances > slack]
        if not samples.size:
            return last, following
        if find_tangent(after, self.metric, point.tangent)[1] * point.tangent[1] <= 0:
            return None
        piece = PieceInterpolation(before, after, self.metric)
        for sample in samples.tolist():
            optimum = piece.find_optimum(sample)
            if optimum is None:
                return None
            if np.any(optimum.margins < VIOLATED):
                change = self._locate_change(before, optimum)
                return None if change is None else (passed, change)
            passed.append(PathPoint(optimum, point.tangent, sampled=True))
            before = optimum
        return [*passed, *last], following

    def _samples_ahead(self, point: PathPoint) -> Array:
        """Return the samples in the direction of the tangent, in order; none where the curve is vertical."""
        last, slack = point.tangent[1], 1e-12 * self.nlp.width
        if last > 0:
            return np.asarray(self.samples[self.samples > point.value + slack])
        return np.asarray(self.samples[self.samples < point.value - slack][::-1] if last else self.samples[:0])

    def _angle(self, optimum: KktLinearisation, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        weights, weight = self.metric.weigh(optimum.active)
        product = float(weights @ (one[0] * other[0])) + weight * one[1] * other[1]
        return math.acos(min(1.0, max(-1.0, product)))

    def _locate_change(self, before: KktLinearisation, after: KktLinearisation) -> PathChange | None:
        """Return the first change of the active set between two points; None if it is not found."""
        start, margins = before.margins, after.margins
        for _ in range(MOST_CANDIDATES):
            violated = np.flatnonzero(margins < VIOLATED)
            shares = np.maximum(start[violated], 0.0) / (np.maximum(start[violated], 0.0) - margins[violated])
            index = int(violated[np.argmin(shares)])
            share = float(shares.min())
            change = before.pack(after.point.x - before.point.x, after.point.multipliers - before.point.multipliers)
            value = before.point.value + share * (after.point.value - before.point.value)
            optimum = correct(self.nlp, before.move(share * change, value), before.active, at_zero_margin(index))
            if optimum is None or not self._is_between(before, optimum, after):
                return None
            others = optimum.margins.copy()
            others[index] = 0.0
            if not np.any(others < VIOLATED):
                return None if self._is_same_zero(before, optimum, after, index) else self._make_change(optimum, index)
            after, margins = optimum, others
        return None

    def _is_same_zero(
        self, before: KktLinearisation, optimum: KktLinearisation, after: KktLinearisation, index: int
    ) -> bool:
        """Return whether a zero is that from which the curve departs with the constraint just switched.

        Its margin increases there; in a step so long that it decreases to zero again, the first zero is located again.
        """
        if before is not self._switched[0] or index not in self._switched[1]:
            return False
        return self._distance(before, optimum) <= SAME_POINT * self._distance(before, after)

    def _is_between(self, before: KktLinearisation, optimum: KktLinearisation, after: KktLinearisation) -> bool:
        """Return whether a located point lies between two points of the curve, within rounding errors."""
        length = self._distance(before, after)
        moves = [each.point.value - before.point.value for each in (optimum, after)]
        if not self._smooth and moves[0] * moves[1] < 0:
            return False
        return (
            self._distance(before, optimum) <= 1.01 * length + 1e-9
            and self._distance(optimum, after) <= 1.01 * length + 1e-9
        )

    def _distance(self, one: KktLinearisation, other: KktLinearisation) -> float:
        weights, weight = self.metric.weigh(one.active)
        change = one.pack(other.point.x - one.point.x, other.point.multipliers - one.point.multipliers)
        return math.sqrt(float(weights @ change**2) + weight * (other.point.value - one.point.value) ** 2)

    def _make_change(self, optimum: KktLinearisation, index: int) -> PathChange:
        row, last = optimum.differentiate_margin(index)
        packed, by_value = find_tangent(optimum, self.metric)
        rate = float(row @ packed) + last * by_value
        width = abs(optimum.margins[index] * by_value / rate) if rate else math.inf
        kind = PathKind.DEACTIVATION if optimum.active.sides[index] else PathKind.ACTIVATION
        return PathChange(kind, optimum, max(width, np.spacing(abs(optimum.point.value))), index)

    def _switch(self, change: PathChange) -> tuple[PathPoint | None, PathChange | None]:
        """Return the point from which the curve continues after a change, if it does, and a change that this implies.

        If the active constraints determine all unknowns, the multiplier of one that becomes active grows at this point
        until that of another one is zero, which leaves the active set.
        """
        before, index = change.optimum, change.index
        same = abs(before.point.value - self._last_change) <= SAME_PLACE * self.nlp.width
        self._switches, self._last_change = self._switches + 1 if same else 0, before.point.value
        if self._switches > MOST_SWITCHES:
            self.end = "degenerate"
            return None, None
        side = 0 if before.active.sides[index] else before.nearest_side(index)
        start, active, implied = before, before.active.switch(index, side), None
        if side and active.free.size < active.rows.size:
            implied = self._exchange(before, (index, side))
            if implied is None:
                self.end = FEASIBILITY_LIMIT
                return None, None
            start, index = implied.optimum, implied.index
            active = start.active.switch(index, 0)
        optimum = KktLinearisation(self.nlp, start.point, active)
        tangent = find_tangent(optimum, self.metric)
        if not (math.isfinite(tangent[1]) and np.all(np.isfinite(tangent[0]))):
            self.end = "dependent_constraints"
            return None, implied
        row, last = optimum.differentiate_margin(index)
        sign = math.copysign(1.0, float(row @ tangent[0]) + last * tangent[1])
        self._switched = (optimum, {change.index, index})
        return PathPoint(optimum, (sign * tangent[0], sign * tangent[1])), implied

    def _restart(
        self, point: PathPoint, optimum: KktLinearisation, distances: Sequence[float] = DISTANCES
    ) -> PathPoint | None:
        """Return a point beyond an optimum, up to the next sample or the end of the range; None if none exists."""
        direction = math.copysign(1.0, point.tangent[1])
        ahead = self.samples[(self.samples - optimum.point.value) * direction > 1e-12 * self.nlp.width]
        limit = float((ahead if ahead.size else self.samples[::-1])[0 if direction > 0 else -1])
        after = find_optimum_beyond(optimum, direction, limit, distances)
        if after is None:
            self.end = "no_convergence"
            return None
        return self._depart(after, direction, sampled=after.point.value == limit)

    def _solve_again(self, point: PathPoint) -> PathPoint:
        """Return a point after its sign changes are located again; the point itself if the solve fails."""
        optimum = solve_nearby(point.optimum, point.value, SAME_OPTIMUM)
        direction = math.copysign(1.0, point.tangent[1])
        return point if optimum is None else self._depart(optimum, direction, sampled=point.sampled)

    def _depart(self, optimum: KktLinearisation, direction: float, *, sampled: bool) -> PathPoint:
        """Return an optimum as the point from which the curve continues towards larger or smaller values."""
        self.nlp = optimum.nlp
        packed, last = find_tangent(optimum, self.metric)
        sign = math.copysign(1.0, direction * last)
        return PathPoint(optimum, (sign * packed, sign * last), sampled=sampled)

    def _exchange(self, optimum: KktLinearisation, entering: tuple[int, int]) -> PathChange | None:
        """Return the change of the constraint that leaves the active set as another one enters it; None if none does.

        Parameters
        ----------
        optimum : KktLinearisation
            The point, without the entering constraint.
        entering : (int, int)
            The entering constraint and its side.
        """
        active, n, rates = optimum.active, self.nlp.size, optimum.respond_to_multiplier(*entering)
        falling = np.where(active.equal, 0.0, -active.sides * rates)
        candidates = np.flatnonzero(falling > 1e-12 * worst(np.abs(rates)))
        if not candidates.size:
            return None
        limits = optimum.margins[candidates] / falling[candidates]
        leaving, size = int(candidates[np.argmin(limits)]), max(0.0, float(limits.min()))
        index, side = entering
        multipliers = optimum.point.multipliers + size * rates[n:]
        if index >= n:
            multipliers[index - n] += side * size
        point = KktPoint(optimum.point.x, multipliers, optimum.point.value)
        after = KktLinearisation(self.nlp, point, active.switch(index, side))
        return PathChange(PathKind.DEACTIVATION, after, np.spacing(abs(optimum.point.value)), leaving)

    def _locate_turning_point(self, one: PathPoint, other: PathPoint) -> PathChange | None:
        """Return the turning point between two points of the same piece, if the parameter turns back."""
        if one.tangent[1] * other.tangent[1] >= 0:
            return None
        low, high = 0.0, self._distance(one.optimum, other.optimum)
        ends = [one.tangent[1], other.tangent[1]]
        best, width = other.optimum, math.inf
        for _ in range(40):
            step = low + (high - low) * ends[0] / (ends[0] - ends[1])
            packed, last = one.tangent
            predicted = one.optimum.move(step * packed, one.value + step * last)
            optimum = correct(self.nlp, predicted, one.optimum.active, at_distance(self.metric, one.tangent, predicted))
            if optimum is None:
                break
            slope = find_tangent(optimum, self.metric, one.tangent)[1]
            best, width = optimum, abs(slope) * (high - low)
            if width < 1e-14 * self.nlp.width:
                break
            if slope * one.tangent[1] > 0:
                low, ends = step, [slope, 0.5 * ends[1]]
            else:
                high, ends = step, [0.5 * ends[0], slope]
        return PathChange(PathKind.TURNING_POINT, best, width, turns=True)
