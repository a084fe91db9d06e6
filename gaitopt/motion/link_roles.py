"""Roles of the links of a walker (stance leg, swing leg, body), and the rotation of drawings by the slope."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.coordinate_entries import CONTACT
from gaitopt.motion.motion import Array, Motion, are_finite

Links = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class LinkRoles:
    """The links of a walker by their roles.

    Attributes
    ----------
    stance, swing, body : tuple of pairs of int
        Links nearer to the stance foot, nearer to the landing foot, and equally near to both.
    stance_foot, swing_foot : int
        Points of the stance foot and of the landing foot.
    joints : tuple of int
        Points where legs meet, such as the hip; all other points than the feet of a robot without links.
    """

    stance: Links
    swing: Links
    body: Links
    stance_foot: int
    swing_foot: int
    joints: tuple[int, ...]


def classify_links(motion: Motion) -> LinkRoles:
    """Return the roles of the links of a motion from the positions of its feet.

    The robot is not needed: the motion of a loaded file suffices.

    Examples
    --------
    >>> from gaitopt import load
    >>> classify_links(load("docs/examples/compass_slip.h5").motion).joints
    (1,)
    """
    first = motion.segments[0]
    stance_foot = _nearest(first.points[:, :, 0], first.contact[:, 0])
    swing_foot = len(motion.points) - 1
    if motion.jumps:
        jump = motion.jumps[0]
        last = next(segment for segment in reversed(motion.segments) if segment.step == jump.step)
        rims = last.rims
        place = jump.q_next[CONTACT] if rims is None else rims[:2, 1, -1] - [0, rims[2, 1, -1]]
        swing_foot = _nearest(last.points[:, :, -1], place)
    near, far = (_distances(motion, foot) for foot in (stance_foot, swing_foot))
    legs: dict[int, list[tuple[int, int]]] = {-1: [], 0: [], 1: []}
    for a, b in motion.links:
        legs[int(np.sign(min(near[a], near[b]) - min(far[a], far[b])))].append((a, b))
    ends = {point for link in motion.links for point in link}
    joints = tuple(point for point in sorted(ends) if near[point] == far[point] and _degree(motion, point) > 1)
    if not motion.links:
        joints = tuple(point for point in range(len(motion.points)) if point not in (stance_foot, swing_foot))
    return LinkRoles(tuple(legs[-1]), tuple(legs[1]), tuple(legs[0]), stance_foot, swing_foot, joints)


def is_drawable(motion: Any) -> bool:
    """Return whether a motion is finite and has a positive duration, unlike some last iterates of failed solves.

    Parameters
    ----------
    motion : Motion or PlanarMotion

    Examples
    --------
    >>> from gaitopt import load
    >>> is_drawable(load("docs/examples/compass_slip.h5").motion)
    True
    """
    names = ("time", "q", "v", "torque", "force", "points")
    parts = [getattr(segment, name) for segment in motion.segments for name in names]
    return all(map(are_finite, parts)) and motion.period > 0


def tilt(points: Array, slope: float) -> Array:
    """Return positions of the slope-fixed frame in the level frame, where gravity points down.

    Parameters
    ----------
    points : (2, ...) array [m]
    slope : float [rad]
        Downhill, which is to the right.

    Examples
    --------
    >>> tilt(np.array([1.0, 0.0]), np.pi / 2).round(6).tolist()
    [0.0, -1.0]
    """
    c, s = np.cos(slope), np.sin(slope)
    return np.stack([c * points[0] + s * points[1], c * points[1] - s * points[0]])


def _nearest(points: Array, place: Array) -> int:
    return int(np.argmin(np.linalg.norm(points - place[:, None], axis=0)))


def _degree(motion: Motion, point: int) -> int:
    return sum(point in link for link in motion.links)


def _distances(motion: Motion, start: int) -> list[int]:
    """Return the number of links between a point and each point."""
    unreached = len(motion.points) + 1
    distance = [unreached] * len(motion.points)
    distance[start] = 0
    for _ in motion.links:
        for a, b in motion.links:
            distance[a], distance[b] = min(distance[a], distance[b] + 1), min(distance[b], distance[a] + 1)
    return distance


def assign_links(links: Links, feet: Mapping[int, int], bodies: Sequence[str]) -> tuple[int | None, ...]:
    """Return the contact to whose leg each link belongs: the one at the fewest links' distance.

    Among contacts of one body at the same distance it is the first one; None if contacts of several bodies are.

    Parameters
    ----------
    links : tuple of pairs of int
    feet : mapping of int to int
        Point of each contact, by the number of the contact.
    bodies : sequence of str
        Body of each contact.

    Examples
    --------
    >>> assign_links(((0, 1), (0, 2), (0, 3)), {0: 1, 1: 2}, ["left", "right"])
    (0, 1, None)
    >>> assign_links(((0, 1), (0, 2), (0, 3)), {0: 1, 1: 2}, ["foot", "foot"])
    (0, 1, 0)
    """
    far = len(links) + 1
    distances = {contact: _count_links(links, point) for contact, point in feet.items()}
    owners: list[int | None] = []
    for a, b in links:
        nearness = {contact: min(found.get(a, far), found.get(b, far)) for contact, found in distances.items()}
        nearest = [contact for contact, count in nearness.items() if count == min(nearness.values())]
        owners.append(nearest[0] if len({bodies[contact] for contact in nearest}) == 1 else None)
    return tuple(owners)


def number_legs(bodies: Mapping[int, str], exchange: Sequence[int]) -> dict[int, int]:
    """Return the number of the leg of each foot, from 0: contacts of one body, such as heel and toe, belong to one leg.

    Each contact without a body has a leg, and so has each contact that the leg exchange maps to another contact of the
    same body, such as the tips of a wheel.

    Parameters
    ----------
    bodies : mapping of int to str
        Body of each foot, by the number of the contact; empty if it is not known.
    exchange : sequence of int
        Contact i is in the next step what contact ``exchange[i]`` is in this one.

    Examples
    --------
    >>> number_legs({0: "left foot", 1: "left foot", 2: "right foot", 3: "right foot"}, [2, 3, 0, 1])
    {0: 0, 1: 0, 2: 1, 3: 1}
    >>> number_legs({0: "wheel", 1: "wheel"}, [1, 0]), number_legs({0: "", 1: ""}, [1, 0])
    ({0: 0, 1: 1}, {0: 0, 1: 1})
    """
    wheels = {body for foot, body in bodies.items() if exchange[foot] != foot and bodies[exchange[foot]] == body}
    keys = {foot: body if body and body not in wheels else foot for foot, body in bodies.items()}
    order = list(dict.fromkeys(keys.values()))
    return {foot: order.index(key) for foot, key in keys.items()}


def find_joint_points(links: Links, feet: Iterable[int], count: int) -> tuple[int, ...]:
    """Return the points at which links meet, without feet; if there are none, the other ends of the links.

    All `count` points of a robot without links are returned.

    Examples
    --------
    >>> find_joint_points(((0, 1), (0, 2)), [1, 2], 3), find_joint_points(((0, 1),), [1], 2)
    ((0,), (0,))
    """
    if not links:
        return tuple(range(count))
    ends = [point for link in links for point in link]
    others = sorted(set(ends) - set(feet))
    return tuple(point for point in others if ends.count(point) > 1) or tuple(others)


def _count_links(links: Links, start: int) -> dict[int, int]:
    """Return the number of links between a point and each point that it is connected with."""
    distance = {start: 0}
    for _ in links:
        for a, b in links:
            for one, other in ((a, b), (b, a)):
                if one in distance and distance[one] + 1 < distance.get(other, len(links) + 1):
                    distance[other] = distance[one] + 1
    return distance
