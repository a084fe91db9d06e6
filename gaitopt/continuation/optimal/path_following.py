"""Continuation of the optimality conditions over a parameter, with exact changes of the active set.

Between changes of the active set the optimum is a smooth curve of parameter, unknowns and multipliers.  The predictor
follows its tangent, Newton's method corrects.  If a slack or a multiplier has become negative, its zero is located by
Newton's method on the conditions extended by this equation; the constraint then enters or leaves the active set, and
the curve continues with it (Guddat, Guerra Vazquez & Jongen, Parametric Optimization: Singularities, Pathfollowing and
Jumps, 1990, chapter 2).  At a fold the reduced Hessian is singular and the parameter turns back.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import attrs
import numpy as np

from gaitopt.arguments import check_arguments
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
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.reductions import worst

VIOLATED = -1e-9
"""Margin below which a constraint is violated, or a multiplier has the wrong sign, within rounding errors."""

SAME_PLACE = 1e-11
"""Distance, relative to the range, of changes of the active set at the same value of the parameter."""

MOST_SWITCHES = 12
"""Largest number of changes of the active set at the same value of the parameter."""

MOST_CANDIDATES = 12
"""Largest number of constraints tried as the first one that changes in a step."""


LARGE_MULTIPLIER = 1e5
"""Scaled multiplier at an end beyond which no gait satisfies the constraints: multipliers tend to infinity there."""

FEASIBILITY_LIMIT = "feasibility_limit"
"""End of a curve beyond which no gait satisfies the constraints."""


class PathKind(Enum):
    """Kind of a special point of a branch of optimal gaits; the value states what happens there."""

    ACTIVATION = "a constraint becomes active"
    DEACTIVATION = "the multiplier of a constraint vanishes and it becomes inactive"
    TURNING_POINT = "the reduced Hessian is singular and the branch turns back"

    @property
    def key(self) -> str:
        """Name for files and JSON, in lower case."""
        return self.name.lower()

    @property
    def label(self) -> str:
        """Name for tables and figures."""
        return self.key.replace("_", " ")


@check_arguments
@attrs.frozen(kw_only=True)
class PathOptions:
    """Options of the continuation of optima.  Lengths are relative to the range and to the typical unknowns.

    Attributes
    ----------
    first_step, longest_step, shortest_step : float
    largest_angle : float [rad]
        Largest angle between the tangents of consecutive points.
    most_points : int
        Largest number of points of a branch, special points included.

    Examples
    --------
    >>> PathOptions().longest_step
    0.1
    """

    first_step: float = attrs.field(default=0.02, validator=positive())
    longest_step: float = attrs.field(default=0.1, validator=positive())
    shortest_step: float = attrs.field(default=1e-9, validator=positive())
    largest_angle: float = attrs.field(default=0.5, validator=positive())
    most_points: int = attrs.field(default=5000, validator=whole_number())


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A point of the curve.

    Attributes
    ----------
    here : KktLinearisation
    tangent : ((k,) array, float)
        Unit tangent in the direction of the continuation: of the packed vector, and of the parameter.
    sampled : bool
        Whether the parameter has one of the requested values.
    """

    here: KktLinearisation
    tangent: tuple[Array, float]
    sampled: bool = False

    @property
    def value(self) -> float:
        """Parameter."""
        return self.here.point.value


@dataclass(frozen=True, eq=False)
class PathChange:
    """A special point of the curve.

    Attributes
    ----------
    kind : PathKind
    here : KktLinearisation
        With the active set before the change.
    width : float
        Residual of the location in the unit of the parameter.
    index : int
        Constraint that becomes active or inactive; -1 at a turning point.
    turns : bool
        Whether the parameter turns back.
    """

    kind: PathKind
    here: KktLinearisation
    width: float
    index: int = -1
    turns: bool = False


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

    def follow(self, start: KktLinearisation, direction: float) -> Iterator[PathPoint | PathChange]:
        """Yield points and special points in order, from an optimum toward larger or smaller values."""
        packed, last = find_tangent(start, self.metric)
        sign = math.copysign(1.0, direction * last)
        point, step = PathPoint(start, (sign * packed, sign * last), sampled=True), self.options.first_step
        yield point
        for _ in range(self.options.most_points):
            if self._is_at_end(point):
                self.end = "range_end"
                return
            following = self._advance(point, step)
            if following is None:
                step *= 0.5
                if step < self.options.shortest_step:
                    large = worst(np.abs(point.here.point.multipliers)) > LARGE_MULTIPLIER
                    self.end = FEASIBILITY_LIMIT if large else "no_convergence"
                    yield point
                    return
                continue
            step = min(1.5 * step, self.options.longest_step)
            if isinstance(following, PathPoint):
                turning = self._locate_turning_point(point, following)
                if turning is not None:
                    yield turning
                point = following
                yield point
                continue
            after, implied = self._switch(following)
            turns = after is not None and after.tangent[1] * point.tangent[1] < 0
            yield replace(following, turns=turns and implied is None)
            if implied is not None:
                yield replace(implied, turns=turns)
            if after is None:
                return
            point = after
        self.end = "most_points"

    def _is_at_end(self, point: PathPoint) -> bool:
        slack = 1e-13 * self.nlp.width
        if point.tangent[1] > 0:
            return point.value >= self.samples[-1] - slack
        return point.value <= self.samples[0] + slack

    def _advance(self, point: PathPoint, step: float) -> PathPoint | PathChange | None:
        """Return the next point, or the first change of the active set before it; None if the step is too long."""
        packed, last = point.tangent
        sample = self._next_sample(point)
        distance = abs(sample - point.value) / abs(last) if last else math.inf
        sampled = distance <= step
        step = min(step, distance)
        predicted = point.here.move(step * packed, sample if sampled else point.value + step * last)
        condition = at_value(sample) if sampled else at_distance(self.metric, point.tangent, predicted)
        here = correct(self.nlp, predicted, point.here.active, condition, point.here)
        if here is None:
            return None
        if np.any(here.margins < VIOLATED):
            return self._locate_change(point.here, here)
        tangent = find_tangent(here, self.metric, point.tangent)
        if not math.isfinite(tangent[1]) or self._angle(here, tangent, point.tangent) > self.options.largest_angle:
            return None
        return PathPoint(here, tangent, sampled)

    def _next_sample(self, point: PathPoint) -> float:
        slack = 1e-12 * self.nlp.width
        if point.tangent[1] > 0:
            place = int(np.searchsorted(self.samples, point.value + slack, side="right"))
            return float(self.samples[min(place, self.samples.size - 1)])
        place = int(np.searchsorted(self.samples, point.value - slack)) - 1
        return float(self.samples[max(place, 0)])

    def _angle(self, here: KktLinearisation, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        weights, weight = self.metric.weigh(here.active)
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
            here = correct(self.nlp, before.move(share * change, value), before.active, at_zero_margin(index))
            if here is None or not self._is_between(before, here, after):
                return None
            others = here.margins.copy()
            others[index] = 0.0
            if not np.any(others < VIOLATED):
                return self._make_change(here, index)
            after, margins = here, others
        return None

    def _is_between(self, before: KktLinearisation, here: KktLinearisation, after: KktLinearisation) -> bool:
        """Return whether a located point lies between two points of the curve, within rounding errors."""
        length = self._distance(before, after)
        return (
            self._distance(before, here) <= 1.01 * length + 1e-9 and self._distance(here, after) <= 1.01 * length + 1e-9
        )

    def _distance(self, one: KktLinearisation, other: KktLinearisation) -> float:
        weights, weight = self.metric.weigh(one.active)
        change = one.pack(other.point.x - one.point.x, other.point.multipliers - one.point.multipliers)
        return math.sqrt(float(weights @ change**2) + weight * (other.point.value - one.point.value) ** 2)

    def _make_change(self, here: KktLinearisation, index: int) -> PathChange:
        row, last = here.differentiate_margin(index)
        packed, by_value = find_tangent(here, self.metric)
        rate = float(row @ packed) + last * by_value
        width = abs(here.margins[index] * by_value / rate) if rate else math.inf
        kind = PathKind.DEACTIVATION if here.active.sides[index] else PathKind.ACTIVATION
        return PathChange(kind, here, max(width, np.spacing(abs(here.point.value))), index)

    def _switch(self, change: PathChange) -> tuple[PathPoint | None, PathChange | None]:
        """Return the point from which the curve continues after a change, if it does, and a change that this implies.

        If the active constraints determine all unknowns, the multiplier of one that becomes active grows at this point
        until that of another one is zero, which leaves the active set.
        """
        before, index = change.here, change.index
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
            start, index = implied.here, implied.index
            active = start.active.switch(index, 0)
        here = KktLinearisation(self.nlp, start.point, active)
        tangent = find_tangent(here, self.metric)
        if not (math.isfinite(tangent[1]) and np.all(np.isfinite(tangent[0]))):
            self.end = "dependent_constraints"
            return None, implied
        row, last = here.differentiate_margin(index)
        sign = math.copysign(1.0, float(row @ tangent[0]) + last * tangent[1])
        return PathPoint(here, (sign * tangent[0], sign * tangent[1])), implied

    def _exchange(self, here: KktLinearisation, entering: tuple[int, int]) -> PathChange | None:
        """Return the change of the constraint that leaves the active set as another one enters it; None if none does.

        Parameters
        ----------
        here : KktLinearisation
            The point, without the entering constraint.
        entering : (int, int)
            The entering constraint and its side.
        """
        active, n, rates = here.active, self.nlp.size, here.respond_to_multiplier(*entering)
        falling = np.where(active.equal, 0.0, -active.sides * rates)
        candidates = np.flatnonzero(falling > 1e-12 * worst(np.abs(rates)))
        if not candidates.size:
            return None
        limits = here.margins[candidates] / falling[candidates]
        leaving, size = int(candidates[np.argmin(limits)]), max(0.0, float(limits.min()))
        index, side = entering
        multipliers = here.point.multipliers + size * rates[n:]
        if index >= n:
            multipliers[index - n] += side * size
        point = KktPoint(here.point.x, multipliers, here.point.value)
        after = KktLinearisation(self.nlp, point, active.switch(index, side))
        return PathChange(PathKind.DEACTIVATION, after, np.spacing(abs(here.point.value)), leaving)

    def _locate_turning_point(self, one: PathPoint, other: PathPoint) -> PathChange | None:
        """Return the turning point between two points of the same piece, if the parameter turns back."""
        if one.tangent[1] * other.tangent[1] >= 0:
            return None
        low, high = 0.0, self._distance(one.here, other.here)
        ends = [one.tangent[1], other.tangent[1]]
        best, width = other.here, math.inf
        for _ in range(40):
            step = low + (high - low) * ends[0] / (ends[0] - ends[1])
            packed, last = one.tangent
            predicted = one.here.move(step * packed, one.value + step * last)
            here = correct(self.nlp, predicted, one.here.active, at_distance(self.metric, one.tangent, predicted))
            if here is None:
                break
            slope = find_tangent(here, self.metric, one.tangent)[1]
            best, width = here, abs(slope) * (high - low)
            if width < 1e-14 * self.nlp.width:
                break
            if slope * one.tangent[1] > 0:
                low, ends = step, [slope, 0.5 * ends[1]]
            else:
                high, ends = step, [0.5 * ends[0], slope]
        return PathChange(PathKind.TURNING_POINT, best, width, turns=True)
