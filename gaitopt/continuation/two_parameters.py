"""Curves of special points in the plane of two parameters.

A curve is followed by its tangent in the plane of the scaled parameters.  Its next point is located along the line
across the tangent through the predicted point, as a special point of the one-parameter family on this line.  No
equations beyond those of one parameter are needed, so every kind of special point has a curve.  The points of
codimension two at which a curve ends or turns sharply are located in :mod:`gaitopt.continuation.codimension_two`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram
from gaitopt.continuation.codimension_two import locate_corner, locate_meeting
from gaitopt.continuation.gait_lookup import gaits_at
from gaitopt.continuation.gait_source import AnyCycle, AnyFamily, AnyWalkProblem, make_gait_source
from gaitopt.continuation.line_search import NOT_FOUND, LineSearch, PlanePoint
from gaitopt.continuation.parameter_values import unit_of
from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.continuation.tracing import TraceOptions
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array

FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.03, 0.1, 1e-3
"""Step lengths in the plane of the parameters, relative to their ranges."""
CLOSE = 0.02
"""Distance from the end of a curve within which a point of codimension two is sought there."""
FINEST = 2e-4
"""Smallest distance between the points from which a point of codimension two is located."""
MOST_POINTS = 400
ON_BORDER = 1e-9
"""Scaled distance from the border of the range within which a curve ends at its start."""

CurveObserver = Callable[[SpecialCurve], None]
"""Called with a curve whenever a point of it has been added."""


@check_arguments
def trace_curve(
    problem: AnyWalkProblem,
    diagram: BranchDiagram,
    second: Mapping[str, tuple[float, float]],
    *,
    branch: int = 0,
    special: int = 0,
    options: TraceOptions | None = None,
    observer: CurveObserver | None = None,
) -> SpecialCurve:
    """Follow a special point of a branch as a second parameter varies, in both directions.

    Parameters
    ----------
    problem : WalkProblem or PlanarWalkProblem
        The problem for which the diagram was computed, with the same value of the second parameter.
    diagram : BranchDiagram
    second : mapping of str to (float, float)
        Second parameter and its range in SI units.  The first parameter stays within the range of the diagram.
    branch, special : int
        Numbers of the branch and of its special point.
    options : TraceOptions, optional
    observer : callable, optional

    Returns
    -------
    SpecialCurve

    Raises
    ------
    InputError
        If there is no such special point or parameter, or the range excludes the value of the problem.

    Examples
    --------
    >>> import math
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> from gaitopt.continuation import trace_curve
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.8)})
    >>> curve = trace_curve(wheel, diagram, {"slope": (math.radians(12.5), math.radians(13.5))})
    >>> curve.kind.key, curve.closed, bool(np.all(np.diff(curve.values[:, 0]) > 0))
    ('slip_onset', False, True)
    """
    if len(second) != 1:
        raise InputError(f"second must be one parameter with its range, got {second!r}.")
    ((name, ends),) = second.items()
    source = make_gait_source(problem, second)
    if name == diagram.parameter:
        raise InputError(f"The second parameter must differ from the first, {name!r}.")
    points = diagram.branches[branch].special if 0 <= branch < len(diagram.branches) else ()
    if not 0 <= special < len(points):
        raise InputError(
            f"Branch {branch} of the diagram has no special point {special}; it has {len(points)}, counted from 0."
        )
    value = float(source.values[name])
    if not min(ends) <= value <= max(ends):
        raise InputError(f"The range of {name} must contain the value of the problem, {value:g}.")
    plane = _Plane(problem, diagram, name, ends, options or TraceOptions(), branch)
    return plane.follow(points[special], observer or (lambda curve: None))


class _End(NamedTuple):
    """End of a curve: the reason, and whether it is a point of codimension two."""

    reason: str = ""
    codimension_two: bool = False


@dataclass(frozen=True, eq=False)
class _Plane:
    """The plane of two parameters in which a curve is followed, scaled by their ranges."""

    problem: AnyWalkProblem
    diagram: BranchDiagram
    second: str
    ends: tuple[float, float]
    options: TraceOptions
    branch: int

    @property
    def names(self) -> tuple[str, str]:
        return self.diagram.parameter, self.second

    @property
    def scale(self) -> Array:
        return np.abs(np.array([np.subtract(*self.diagram.ends), np.subtract(*self.ends)]))

    @property
    def bounds(self) -> Array:
        """Scaled range of each parameter, shape (2, 2)."""
        return np.sort(np.array([self.diagram.ends, self.ends]), axis=1) / self.scale[:, None]

    def follow(self, special: SpecialPoint, observer: CurveObserver) -> SpecialCurve:
        """Return the curve through a special point."""
        value = float(make_gait_source(self.problem, {self.second: self.ends}).values[self.second])
        place = np.array([special.value, value]) / self.scale
        start = PlanePoint(place, special, special.z, np.array([self._direction(special), 0.0]))
        search = LineSearch(self._family(special), self.names, self.scale, self.options)
        located, ends = [start], []
        for sign in (1.0, -1.0):
            side, end = self._follow_side(search, start, sign, lambda part: observer(self._curve(part, (_End(),) * 2)))
            if end.reason == "closed":
                return self._curve([start, *side], (end, end))
            located = [*located, *side] if sign > 0 else [*reversed(side), *located]
            ends.append(end)
        return self._curve(located, (ends[1], ends[0]))

    def _follow_side(
        self, search: LineSearch, start: PlanePoint, sign: float, observe: Callable[[list[PlanePoint]], None]
    ) -> tuple[list[PlanePoint], _End]:
        """Return the points of the curve on one side of its start, and its end there."""
        tangent, step = np.array([0.0, sign]), FIRST_STEP
        points, last = list[PlanePoint](), start
        if not self._contains(start.place + ON_BORDER * tangent):
            return points, _End("range_end")
        while len(points) < MOST_POINTS:
            following = search.locate(last, last.place + step * tangent, last.across(tangent), step)
            if isinstance(following, str):
                meeting = locate_meeting(search, last, tangent, step, FINEST) if step < CLOSE else None
                if meeting is not None and self._contains(meeting.point.place):
                    return [*points, meeting.point], _End(f"meets {meeting.other.label}", codimension_two=True)
                step /= 4
                if step < SHORTEST_STEP:
                    return points, _End(following, codimension_two=following != NOT_FOUND)
                continue
            if not self._contains(following.place):
                return [*points, self._reach_border(search, last, following)], _End("range_end")
            corner = locate_corner(search, last, following, SHORTEST_STEP)
            points += [following] if corner is None else [corner, following]
            move = following.place - (last if corner is None else corner).place
            tangent, step = move / np.linalg.norm(move), min(1.5 * step, LONGEST_STEP)
            observe(points)
            if len(points) > 2 and float(np.linalg.norm(following.place - start.place)) < step:
                return [*points, start], _End("closed")
            last = following
        return points, _End("most_points")

    def _contains(self, place: Array) -> bool:
        return bool(np.all((place >= self.bounds[:, 0]) & (place <= self.bounds[:, 1])))

    def _reach_border(self, search: LineSearch, last: PlanePoint, following: PlanePoint) -> PlanePoint:
        """Return the point of the curve on the border of the range, between a point inside and one outside."""
        border = np.clip(following.place, *self.bounds.T)
        axis = int(np.argmax(np.abs(following.place - border)))
        move = following.place - last.place
        share = (border[axis] - last.place[axis]) / move[axis]
        length = float(np.linalg.norm(move))
        line = np.eye(2)[1 - axis]
        normal = line if line @ last.across(move / length) >= 0 else -line
        point = search.locate(last, last.place + share * move, normal, length)
        return following if isinstance(point, str) else point

    def _direction(self, special: SpecialPoint) -> float:
        """Return the sign with which the branch of the diagram passes a special point, or approaches its end."""
        first, final = (float(value) for value in self.diagram.branches[self.branch].values[[0, -1]])
        begins = not special.multipliers_after.size and abs(special.value - first) < abs(special.value - final)
        return float(np.sign(first - final if begins else final - first)) or 1.0

    def _family(self, special: SpecialPoint) -> AnyFamily:
        engine, gaits = self.options.engine, list[AnyCycle]()
        for shift in (1e-4, -1e-4):
            value = special.value + shift * float(self.scale[0])
            gaits += gaits_at(self.problem, self.diagram, value, branch=self.branch, engine=engine)
        if not gaits:
            raise InputError(
                f"No gait was found near the special point at {self.diagram.parameter} = {special.value:.6g}; "
                "trace the branch again, or choose another special point."
            )
        source = make_gait_source(self.problem, {self.diagram.parameter: self.diagram.ends}, engine)
        family = source.start(gaits[0], special.value).family
        return replace(family, parameters={**family.parameters, **source.values})

    def _curve(self, located: list[PlanePoint], ends: tuple[_End, _End]) -> SpecialCurve:
        first = located[0].special
        return SpecialCurve(
            kind=first.kind,
            parameters=self.names,
            values=np.array([each.place * self.scale for each in located]),
            states=np.array([each.special.z for each in located]),
            before=first.before,
            after=first.after,
            begin=ends[0].reason,
            end=ends[1].reason,
            codimension_two=(ends[0].codimension_two, ends[1].codimension_two),
            units=(unit_of(self.problem.robot, self.names[0]), unit_of(self.problem.robot, self.names[1])),
        )
