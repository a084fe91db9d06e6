"""Contacts that are below the ground while they are armed, and touchdowns from below."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.terrain import Terrain
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.motion.stated_changes import find_closing

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot

LEAST_PENETRATION = 1e-6
"""Depth [m] from which an armed contact counts as below the ground."""

LEAST_DEPTH = 1e-4
"""Depth below the ground from which a swinging contact is listed [m]."""

POINTS = np.array([0.0, 0.25, 0.5, 0.75])
"""Fractions of the interval between two samples at which gaps and arming are evaluated."""


class SampledPart(NamedTuple):
    """Samples of a smooth part of a motion.

    Attributes
    ----------
    modes : tuple of Mode
        Mode of each contact.
    time : (K,) array [s]
    q, v : (n_q, K) arrays
    closing : frozenset of int
        Contacts that touch down at the end.
    """

    modes: tuple[Mode, ...]
    time: Array
    q: Array
    v: Array
    closing: frozenset[int]


@dataclass(frozen=True, kw_only=True)
class Penetration:
    """A contact that is below the ground while it is armed, in one of its swings.

    Attributes
    ----------
    contact : str
    begin : float [s]
        Time from which it is below the ground and armed.
    deepest : float [s]
        Time of its largest depth.
    depth : float [m]
        Largest depth while it is armed.
    rise : float [m]
        Largest gap afterwards, until its touchdown or the end of the motion.
    lands : bool
        Whether the swing ends with its touchdown.

    Examples
    --------
    >>> scuff = Penetration(contact="heel", begin=0.3, deepest=0.31, depth=5e-4, rise=0.03, lands=True)
    >>> scuff.is_touchdown_from_below
    False
    """

    contact: str
    begin: float
    deepest: float
    depth: float
    rise: float
    lands: bool

    @property
    def is_touchdown_from_below(self) -> bool:
        """Whether the contact rises less than it was deep before its touchdown, or is still below at the end."""
        return self.rise <= (self.depth if self.lands else 0.0)

    def describe(self) -> str:
        """Return contact, times and depth as a clause."""
        return (
            f"contact {self.contact!r} is below the ground while it is armed, from {self.begin:.4g} s, by up to "
            f"{1000 * self.depth:.2g} mm at {self.deepest:.4g} s"
        )

    def describe_touchdown(self) -> str:
        """Return the clause, the end of the swing, and the remedy."""
        height = 1000 * max(self.rise, 0.0)
        rises = f"rises only {height:.2g} mm above it, not more than this depth, before it touches down"
        end = rises if self.lands else "remains below it"
        return (
            f"{self.describe()}, and then {end}: a touchdown from below is invalid. Use a larger threshold in `armed` "
            "of the contact, or change PlanarLimits.clearance, step length or speed"
        )


def find_penetrations(robot: "PlanarRobot", motion: PlanarMotion) -> list[Penetration]:
    """Return the contacts of a motion that are below the ground while armed, with one entry for each swing.

    Parameters
    ----------
    robot : PlanarRobot
    motion : PlanarMotion

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> find_penetrations(monopod(), motion)
    []
    """
    return find_penetrations_of_parts(robot, motion.parameters, list_parts(robot, motion), motion.terrain)


def list_parts(robot: "PlanarRobot", motion: PlanarMotion) -> list[SampledPart]:
    """Return the smooth parts of a motion.

    Parameters
    ----------
    robot : PlanarRobot
    motion : PlanarMotion
    """
    parts = []
    for number, segment in enumerate(motion.segments):
        names = motion.events[number].names if number < len(motion.events) else ()
        closing = frozenset(robot.contact_names.index(name) for name in find_closing(names))
        modes = tuple(mode for _, mode in segment.state.modes)
        parts.append(SampledPart(modes, segment.time, segment.q, segment.v, closing))
    return parts


def find_penetrations_of_parts(
    robot: "PlanarRobot", values: Mapping[str, float], parts: Sequence[SampledPart], terrain: Terrain | None = None
) -> list[Penetration]:
    """Return the contacts that are below the ground while armed, from the successive parts of a motion.

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
    >>> find_penetrations_of_parts(monopod(), monopod().resolve({}), [])
    []
    """
    contacts = [i for i, entry in enumerate(robot.contacts) if entry.conditional and not entry.is_stop]
    if not contacts:
        return []
    sampled = [sample_part(robot, values, part, terrain) for part in parts]
    penetrations = []
    for i in contacts:
        for numbers, lands in list_swings(parts, i):
            rows = [(sampled[k][0], sampled[k][1][i], sampled[k][2][i]) for k in numbers]
            time, gap, arming = (np.concatenate(row) for row in zip(*rows, strict=True))
            below = np.flatnonzero((gap < -LEAST_PENETRATION) & (arming > 0))
            if below.size:
                deepest = below[np.argmin(gap[below])]
                penetrations.append(
                    Penetration(
                        contact=robot.contact_names[i],
                        begin=float(time[below[0]]),
                        deepest=float(time[deepest]),
                        depth=float(-gap[deepest]),
                        rise=float(gap[below[-1] :].max()),
                        lands=lands,
                    )
                )
    return penetrations


def continue_swing(robot: "PlanarRobot", motion: PlanarMotion, penetration: Penetration) -> Penetration:
    """Return a penetration with the rise of the whole swing, which may end in the next period.

    Parameters
    ----------
    robot : PlanarRobot
    motion : PlanarMotion
        One period on a plane, after which the legs are exchanged if the robot has a mirror.
    penetration : Penetration
        As `find_penetrations` returns it for the motion.
    """
    if penetration.lands:
        return penetration
    following = list(_exchange_legs(robot, list_parts(robot, motion)))
    contact, rise = robot.contact_names.index(penetration.contact), penetration.rise
    for numbers, lands in list_swings(following, contact):
        if numbers[0] > 0:
            break
        gaps = [sample_part(robot, motion.parameters, following[k], None)[1][contact] for k in numbers]
        return replace(penetration, rise=max(rise, float(np.concatenate(gaps).max())), lands=lands)
    return penetration


def _exchange_legs(robot: "PlanarRobot", parts: Sequence[SampledPart]) -> Iterator[SampledPart]:
    """Yield the parts of the next period, in the coordinates and contacts of the present one."""
    mirror = np.eye(robot.n_q) if robot.mirror is None else np.array(robot.mirror.coordinates)
    places = range(len(robot.contacts)) if robot.mirror is None else robot.mirror.contacts
    for part in parts:
        modes = tuple(part.modes[place] for place in places)
        closing = frozenset(i for i, place in enumerate(places) if place in part.closing)
        yield SampledPart(modes, part.time, mirror @ part.q, mirror @ part.v, closing)


def list_swings(parts: Sequence[SampledPart], contact: int) -> Iterator[tuple[list[int], bool]]:
    """Return the numbers of the parts of each swing of a contact, and whether it ends with the touchdown."""
    numbers: list[int] = []
    for number, part in enumerate(parts):
        if part.modes[contact] is Mode.FREE:
            numbers.append(number)
        last = number + 1 == len(parts) or parts[number + 1].modes[contact] is not Mode.FREE
        if numbers and (last or contact in part.closing):
            yield numbers, contact in part.closing or number + 1 < len(parts)
            numbers = []


def sample_part(
    robot: "PlanarRobot", values: Mapping[str, float], part: SampledPart, terrain: Terrain | None
) -> tuple[Array, Array, Array]:
    """Return times, gaps and arming conditions of a part, at its samples and between them."""
    time, q, v = _interpolate(part)
    p, count = robot.vector(values), time.size
    gap = np.array(robot.gaps.map(count)(q, p)[0], dtype=float).reshape(-1, count)
    arming = np.array(robot.arming.map(count)(q, v, p), dtype=float).reshape(-1, count)
    if terrain is not None:
        places = np.array(robot.rims.map(count)(q, p), dtype=float).reshape(4, count, -1)[0].T
        gap = gap - np.vectorize(terrain.height, otypes=[float])(places)
    return time, gap, arming


def _interpolate(part: SampledPart) -> tuple[Array, Array, Array]:
    """Return times, coordinates and rates at the samples of a part and between them, by cubic polynomials."""
    kept = np.append(True, np.diff(part.time) > 0)
    time, q, v = part.time[kept], part.q[:, kept], part.v[:, kept]
    if time.size == 1:
        return time, q, v
    curve = CubicHermiteSpline(time, q, v, axis=1)
    at = np.append((time[:-1, None] + np.diff(time)[:, None] * POINTS).ravel(), time[-1])
    return at, curve(at), curve(at, 1)
