"""Special points on lines in the plane of two parameters."""

from dataclasses import replace

import attrs
import numpy as np

from gaitopt.continuation.following import BranchFollower
from gaitopt.continuation.gait_family import name_structure
from gaitopt.continuation.gait_source import AnyFamily
from gaitopt.continuation.pseudo_arclength import CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.continuation.tracing import TraceOptions
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array

REACHES = (0.2, 0.05, 0.8, 3.0, 12.0)
"""Distances from the predicted point at which a search along the line begins, relative to the step, in order."""
BEND, LEAST_REACH = 4.0, 1e-3
"""The first search begins at `BEND` times the distance of the last point from its prediction, relative to the step."""
LONGEST_STEP = 0.1
"""Longest step of a search, relative to the length of its line."""
NOT_FOUND = "no such point found beyond"


@dataclass(frozen=True, eq=False)
class PlanePoint:
    """A special point in the plane, and a gait beside it from which the search for the next one starts.

    Attributes
    ----------
    place : (2,) array
        Scaled parameters.
    special : SpecialPoint
    near : (n,) array
        Unknowns of the gait beside the special point.
    normal : (2,) array
        Direction in which the special point is passed, from the sequence before it to that after it.
    offset : float
        Distance from the prediction, relative to the step.
    """

    place: Array
    special: SpecialPoint
    near: Array
    normal: Array
    offset: float = REACHES[0] / BEND

    def across(self, tangent: Array) -> Array:
        """Return the unit vector across a tangent, in the direction in which the special point is passed."""
        across = np.array([tangent[1], -tangent[0]])
        return across if across @ self.normal >= 0 else -across


@dataclass(frozen=True, eq=False)
class LineSearch:
    """Special points of a family of gaits on lines in the plane of two parameters.

    Attributes
    ----------
    family : AnyFamily
    names : (str, str)
    scale : (2,) array
        Ranges of the parameters, by which they are scaled.
    options : TraceOptions
    """

    family: AnyFamily
    names: tuple[str, str]
    scale: Array
    options: TraceOptions

    def locate(self, last: PlanePoint, place: Array, normal: Array, step: float) -> PlanePoint | str:
        """Return the special point of the same kind as another one on the line through a place, or why none exists.

        Parameters
        ----------
        last : PlanePoint
        place, normal : (2,) arrays
            Predicted place, and unit vector along the line.
        step : float
            Distance from the last point, to which the length of the search is proportional.
        """
        across = self.on_line(place, normal, step)
        reasons = list[str]()
        first = max(BEND * last.offset, LEAST_REACH)
        for reach in (*([first] if first < REACHES[0] else []), *REACHES):
            located = self._search(across, last, reach * step, 2.5 * max(reach, 0.4) * step)
            if not isinstance(located, str):
                share, special, near = located
                return PlanePoint(place + share * normal, special, near, normal, abs(share) / step)
            reasons.append(located)
        return next((reason for reason in reasons if reason != NOT_FOUND), NOT_FOUND)

    def on_line(self, place: Array, direction: Array, step: float) -> AnyFamily:
        """Return the family on a line, whose parameter is the distance from a place; steps are relative to `step`."""
        line = {
            name: (float(origin), float(slope))
            for name, origin, slope in zip(self.names, place * self.scale, direction * self.scale, strict=True)
        }
        return replace(self.family, line=line, parameter="", value_scale=step)

    def first_special(
        self, family: AnyFamily, near: Array, ends: tuple[float, float]
    ) -> tuple[CurvePoint, CurvePoint, SpecialPoint] | None:
        """Return the first point of a branch on a line, the last one before a special point, and this special point.

        Parameters
        ----------
        family : AnyFamily
        near : (n,) array
            Gait from which Newton's method starts.
        ends : (float, float)
            Start and end of the search on the line.
        """
        arclength, reach = self.options.arclength, abs(ends[0])
        arclength = attrs.evolve(
            arclength,
            first_step=min(arclength.first_step, 2 * reach / family.value_scale),
            longest_step=max(arclength.longest_step, LONGEST_STEP * (ends[1] - ends[0]) / family.value_scale),
        )
        stepper = Stepper(family, arclength, self.options.checkpoint)
        start = stepper.initialise(near, ends[0], 1.0)
        if start is None:
            return None
        before = start
        for item in BranchFollower(stepper, ends, name_structure).follow(start):
            if not isinstance(item, CurvePoint):
                return start, before, item
            before = item
        return None

    def _search(
        self, family: AnyFamily, last: PlanePoint, reach: float, length: float
    ) -> tuple[float, SpecialPoint, Array] | str:
        """Return the place of the special point on a line, the point, and a gait before it; or why none exists."""
        located = self.first_special(family, last.near, (-reach, length))
        if located is None:
            return NOT_FOUND
        start, before, special = located
        if name_structure(start.sample.structure) != last.special.before:
            return f"the sequence before the special point becomes '{name_structure(start.sample.structure)}'"
        if special.kind is last.special.kind and special.before == last.special.before:
            return special.value, special, before.z
        return f"meets {special.label}"
