"""Curves of special points in the plane of two parameters.

A curve is followed by its tangent in the plane of the scaled parameters.  Its next point is located along the line
across the tangent through the predicted point, as a special point of the one-parameter family on this line.  No
equations beyond those of one parameter are needed, so every kind of special point has a curve.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import attrs
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram
from gaitopt.continuation.following import BranchFollower
from gaitopt.continuation.gait_family import name_structure
from gaitopt.continuation.gait_lookup import gaits_at
from gaitopt.continuation.gait_source import AnyFamily, AnyWalkProblem, make_gait_source
from gaitopt.continuation.pseudo_arclength import CurvePoint, Stepper
from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.continuation.tracing import TraceOptions
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array

REACHES = (0.2, 0.05, 0.8, 3.0, 12.0)
"""Distances from the predicted point at which a search along the line begins, relative to the step, in order."""
BEND, LEAST_REACH = 4.0, 1e-3
"""The first search begins at `BEND` times the distance of the last point from its prediction, relative to the step."""
FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.03, 0.1, 1e-3
"""Step lengths in the plane of the parameters, relative to their ranges."""
MOST_POINTS = 400
ON_BORDER = 1e-9
"""Scaled distance from the border of the range within which a curve ends at its start."""
NOT_FOUND = "no such point found beyond"

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
    """Follow a special point of a branch over a second parameter, in both directions.

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
        raise InputError(f"Branch {branch} of the diagram has no special point {special}; it has {len(points)}.")
    value = float(source.values[name])
    if not min(ends) <= value <= max(ends):
        raise InputError(f"The range of {name} must contain the value of the problem, {value:g}.")
    plane = _Plane(problem, diagram, name, ends, options or TraceOptions(), branch)
    return plane.follow(points[special], observer or (lambda curve: None))


@dataclass(frozen=True, eq=False)
class _Located:
    """A special point in the plane, and a gait beside it from which the search for the next one starts.

    Attributes
    ----------
    place : (2,) array
    special : SpecialPoint
    near : (n,) array
    offset : float
        Distance from the prediction, relative to the step.
    """

    place: Array
    special: SpecialPoint
    near: Array
    offset: float = REACHES[0] / BEND


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

    def follow(self, special: SpecialPoint, observer: CurveObserver) -> SpecialCurve:
        """Return the curve through a special point."""
        value = float(make_gait_source(self.problem, {self.second: self.ends}).values[self.second])
        start = _Located(np.array([special.value, value]) / self.scale, special, special.z)
        family = self._family(special)
        located, ends = [start], []
        for sign in (1.0, -1.0):
            side, end = self._follow_side(family, start, sign, lambda part: observer(self._curve(part, ("", ""))))
            if end == "closed":
                return self._curve([start, *side], ("closed", "closed"))
            located = [*located, *side] if sign > 0 else [*reversed(side), *located]
            ends.append(end)
        return self._curve(located, (ends[1], ends[0]))

    def _follow_side(
        self, family: AnyFamily, start: _Located, sign: float, observe: Callable[[list[_Located]], None]
    ) -> tuple[list[_Located], str]:
        """Return the points of the curve on one side of its start, and the reason for which it ends there."""
        tangent, step = np.array([0.0, sign]), FIRST_STEP
        points, last = list[_Located](), start
        if not self._contains(start.place + ON_BORDER * tangent):
            return points, "range_end"
        while len(points) < MOST_POINTS:
            following = self._locate(family, last, last.place + step * tangent, tangent, step)
            if isinstance(following, str):
                step /= 2
                if step < SHORTEST_STEP:
                    return points, following
                continue
            move = following.place - last.place
            tangent, step = move / np.linalg.norm(move), min(1.5 * step, LONGEST_STEP)
            points.append(following)
            observe(points)
            if not self._contains(following.place):
                return points, "range_end"
            if len(points) > 2 and float(np.linalg.norm(following.place - start.place)) < step:
                return [*points, start], "closed"
            last = following
        return points, "most_points"

    def _contains(self, place: Array) -> bool:
        bounds = np.array([self.diagram.ends, self.ends])
        values = place * self.scale
        return bool(np.all((values >= bounds.min(axis=1)) & (values <= bounds.max(axis=1))))

    def _locate(self, family: AnyFamily, last: _Located, place: Array, tangent: Array, step: float) -> _Located | str:
        """Return the special point of the same kind on the line across the tangent, or why there is none."""
        normal = np.array([tangent[1], -tangent[0]])
        normal *= np.sign(normal @ self._towards(last)) or 1.0
        line = {
            name: (float(origin), float(slope))
            for name, origin, slope in zip(self.names, place * self.scale, normal * self.scale, strict=True)
        }
        across = replace(family, line=line, parameter="", value_scale=step)
        reasons = list[str]()
        first = max(BEND * last.offset, LEAST_REACH)
        for reach in (*([first] if first < REACHES[0] else []), *REACHES):
            found = self._search(across, last, reach * step, 2.5 * max(reach, 0.4) * step)
            if not isinstance(found, str):
                share, special, near = found
                return _Located(place + share * normal, special, near, abs(share) / step)
            reasons.append(found)
        return next((reason for reason in reasons if reason != NOT_FOUND), NOT_FOUND)

    def _towards(self, last: _Located) -> Array:
        """Return the direction in which the branch of the diagram passes the special point, or approaches its end."""
        branch, special = self.diagram.branches[self.branch], last.special
        first, final = (float(value) for value in branch.values[[0, -1]])
        value = float(last.place[0] * self.scale[0])
        begins = not special.multipliers_after.size and abs(value - first) < abs(value - final)
        return np.array([first - final if begins else final - first, 0.0])

    def _search(
        self, family: AnyFamily, last: _Located, reach: float, length: float
    ) -> tuple[float, SpecialPoint, Array] | str:
        """Return the place of the special point on a line, the point, and a gait before it; or why there is none."""
        arclength = self.options.arclength
        arclength = attrs.evolve(arclength, first_step=min(arclength.first_step, 2 * reach / family.value_scale))
        stepper = Stepper(family, arclength, self.options.checkpoint)
        start = stepper.initialise(last.near, -reach, 1.0)
        if start is None:
            return NOT_FOUND
        if name_structure(start.sample.structure) != last.special.before:
            return f"the gait before it becomes '{name_structure(start.sample.structure)}'"
        follower, before = BranchFollower(stepper, (-reach, length), name_structure), start
        for item in follower.follow(start):
            if isinstance(item, CurvePoint):
                before = item
            elif item.kind is last.special.kind and item.before == last.special.before:
                near = before.z if before is not start else start.z
                return item.value, item, near
            else:
                return f"meets {item.kind.label}"
        return NOT_FOUND

    def _family(self, special: SpecialPoint) -> AnyFamily:
        gaits = [
            gait
            for shift in (1e-4, -1e-4)
            for gait in gaits_at(
                self.problem, self.diagram, special.value + shift * float(self.scale[0]), branch=self.branch
            )
        ]
        if not gaits:
            raise InputError(f"No gait was found beside the special point at {special.value:.6g}.")
        source = make_gait_source(self.problem, {self.diagram.parameter: self.diagram.ends}, self.options.engine)
        family = source.start(gaits[0], special.value).family
        return replace(family, parameters={**family.parameters, **source.values})

    def _curve(self, located: list[_Located], ends: tuple[str, str]) -> SpecialCurve:
        first = located[0].special
        return SpecialCurve(
            kind=first.kind,
            parameters=self.names,
            values=np.array([each.place * self.scale for each in located]),
            states=np.array([each.special.z for each in located]),
            before=first.before,
            after=first.after,
            begin=ends[0],
            end=ends[1],
        )
