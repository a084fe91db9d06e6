"""Touchdowns that rounding errors decide: of contacts that graze the ground, or are armed as they pass through it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize_scalar

from gaitopt.dataclass import dataclass
from gaitopt.model.terrain import Terrain
from gaitopt.motion.ground_penetration import SampledPart, list_parts, list_swings, sample_part
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarMotion

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot

GRAZING = 1e-6
"""Largest distance from the ground at which a contact grazes it, or is armed on it [m]."""

CLEAR = 1e-5
"""Gap above which a contact is clear of the ground before and after it grazes [m]."""


@dataclass(frozen=True, kw_only=True)
class UndecidedTouchdown:
    """A touchdown of a free contact that takes place or not, depending on rounding errors.

    Attributes
    ----------
    contact : str
    part : int
        Number of the smooth part of the motion.
    time : float [s]
    gap : float [m]
        Least gap of an armed contact, or gap at the instant from which it is armed.
    at_arming : bool
        Whether the contact passes through the ground where it begins to be armed.

    Examples
    --------
    >>> UndecidedTouchdown(contact="toe", part=1, time=0.3219, gap=-6e-7, at_arming=False).describe()
    "contact 'toe' grazes the ground at 0.3219 s, with a least gap of -0.6 um while it is armed"
    """

    contact: str
    part: int
    time: float
    gap: float
    at_arming: bool

    def describe(self) -> str:
        """Return contact and time as a clause."""
        if self.at_arming:
            return (
                f"contact {self.contact!r} passes through the ground at {self.time:.4g} s, the instant from which it "
                "is armed"
            )
        return (
            f"contact {self.contact!r} grazes the ground at {self.time:.4g} s, with a least gap of "
            f"{1e6 * self.gap:.2g} um while it is armed"
        )

    def describe_failure(self) -> str:
        """Return the clause, its consequence, and the remedy."""
        remedy = "" if self.at_arming else "a larger PlanarLimits.clearance, or "
        return (
            f"{self.describe()}: rounding errors decide whether it touches down there. Use {remedy}a larger threshold "
            "in `armed` of the contact"
        )


def find_undecided_touchdowns(robot: "PlanarRobot", motion: PlanarMotion) -> list[UndecidedTouchdown]:
    """Return the touchdowns of a motion that rounding errors decide.

    Parameters
    ----------
    robot : PlanarRobot
    motion : PlanarMotion

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> find_undecided_touchdowns(monopod(), motion)
    []
    """
    parts = list_parts(robot, motion)
    return find_undecided_touchdowns_of_parts(robot, motion.parameters, parts, motion.terrain)


def find_undecided_touchdowns_of_parts(
    robot: "PlanarRobot", values: Mapping[str, float], parts: Sequence[SampledPart], terrain: Terrain | None = None
) -> list[UndecidedTouchdown]:
    """Return the touchdowns that rounding errors decide in the successive parts of a motion.

    Between two samples, the motion is interpolated by a cubic polynomial.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        Every parameter by name.
    parts : sequence of SampledPart
    terrain : Terrain, optional
        By default a plane.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> find_undecided_touchdowns_of_parts(monopod(), monopod().resolve({}), [])
    []
    """
    contacts = [i for i, entry in enumerate(robot.contacts) if entry.conditional and not entry.is_stop]
    if not contacts:
        return []
    sampled = [sample_part(robot, values, part, terrain) for part in parts]
    found = []
    for i in contacts:
        for numbers, _ in list_swings(parts, i):
            rows = [(sampled[number][0], sampled[number][1][i], sampled[number][2][i]) for number in numbers]
            swing = []
            for place, at_arming, begin, end in _list_spans(rows):
                curve = _GapCurve(robot, values, parts[numbers[place]], terrain, i)
                time = curve.locate_arming(begin, end) if at_arming else curve.locate_least_gap(begin, end)
                gap = curve.gap(time)
                if abs(gap) < GRAZING and (at_arming or curve.arming(time) > 0):
                    name, number = robot.contact_names[i], numbers[place]
                    swing.append(UndecidedTouchdown(contact=name, part=number, time=time, gap=gap, at_arming=at_arming))
            found += [one for one in swing if one.at_arming] or swing
    return found


def _list_spans(rows: Sequence[tuple[Array, Array, Array]]) -> Iterator[tuple[int, bool, float, float]]:
    """Return the time spans in which a touchdown may be undecided, from times, gaps and arming in the parts of a swing.

    A span has the number of its part, and whether the contact is armed in it while its gap decreases, or has its least
    gap.  Before and after it, the contact is clear of the ground.
    """
    highest = [gap.max() for _, gap, _ in rows]
    for place, (time, gap, arming) in enumerate(rows):
        armed = np.flatnonzero((arming[:-1] <= 0) & (arming[1:] > 0) & (gap[:-1] > gap[1:]))
        least = np.flatnonzero((gap[1:-1] <= gap[:-2]) & (gap[1:-1] < gap[2:])) + 1
        for at_arming, first, k in [*((True, k, k) for k in armed), *((False, k - 1, k) for k in least)]:
            before, after = [*highest[:place], gap[: k + 1].max()], [*highest[place + 1 :], gap[k + 1 :].max()]
            near = gap[k] < CLEAR + np.ptp(gap[first : k + 2])  # the least gap lies between samples
            if near and min(max(before), max(after)) > CLEAR:
                yield place, at_arming, float(time[first]), float(time[k + 1])


class _GapCurve:
    """The gap and the arming condition of a contact in a part of a motion, as functions of time."""

    def __init__(
        self,
        robot: "PlanarRobot",
        values: Mapping[str, float],
        part: SampledPart,
        terrain: Terrain | None,
        contact: int,
    ) -> None:
        kept = np.append(True, np.diff(part.time) > 0)
        self._motion = CubicHermiteSpline(part.time[kept], part.q[:, kept], part.v[:, kept], axis=1)
        self._evaluate = lambda at: sample_part(robot, values, at, terrain)
        self._part, self._contact = part, contact

    def gap(self, time: float) -> float:
        """Return the gap [m]."""
        return float(self._at(time)[1][self._contact, 0])

    def arming(self, time: float) -> float:
        """Return the value that is positive while the contact is armed."""
        return float(self._at(time)[2][self._contact, 0])

    def locate_arming(self, begin: float, end: float) -> float:
        """Return the time in a span from which the contact is armed."""
        return float(brentq(self.arming, begin, end, xtol=1e-12))

    def locate_least_gap(self, begin: float, end: float) -> float:
        """Return the time of the least gap in a span."""
        return float(minimize_scalar(self.gap, bounds=(begin, end), method="bounded").x)

    def _at(self, time: float) -> tuple[Array, Array, Array]:
        q, v = self._motion(time)[:, None], self._motion(time, 1)[:, None]
        return self._evaluate(self._part._replace(time=np.array([time]), q=q, v=v))
