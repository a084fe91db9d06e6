"""Implausible geometry of a planar robot: reversed directions of legs and feet, and feet longer than the robot is high.

A robot may measure its angles from any direction, so that these sentences are remarks, not faults.
"""

import math
from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.plausible_sizes import name_unit

POSES, SWING = 40, 0.3
"""Number of examined poses, and the largest angle in them [rad]."""

UPRIGHT = (-0.1, 0.0, 0.1)
"""Values of all angles in upright poses, in which the legs are parallel [rad]."""

LONGEST_FOOT = 2.5
"""Largest plausible distance between contacts of one body, relative to the distance of the centre of mass from the
nearer one; at most 2 for a wheel."""

CLEAR = 1e-3
"""Distance [m] between feet, or of a toe from its heel, from which their order is certain."""


def report_implausible_geometry(robot: PlanarRobot, values: Mapping[str, float]) -> tuple[str, ...]:
    """Return a sentence for each direction of legs or feet that seems reversed, and for each foot that is too long.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        Values of all parameters.

    Examples
    --------
    >>> from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
    >>> report_implausible_geometry(flat_foot_walker(), flat_foot_walker().resolve({}))
    ()
    """
    values = {**values, "slope": 0.0}
    feet = [i for i, contact in enumerate(robot.contacts) if not (contact.is_stop or contact.falls)]
    q, p = _sample_poses(robot), robot.vector(values)
    if not feet or robot.travel is None or not float(robot.mass(p)) * values["gravity"] > 0:
        return ()
    gaps, slides = (np.array(part) for part in robot.gaps.map(POSES)(q, ca.repmat(ca.DM(p), 1, POSES)))
    centre = _measure_centre(robot, q, values)
    if np.all(gaps[feet] > centre[1]):
        names = ", ".join(robot.contact_names[i] for i in feet)
        return (
            f"Robot {robot.name!r}: in poses with small angles, all feet ({names}) are above the centre of mass: check "
            "the direction from hip to foot and its sign, such as (sin(angle), -cos(angle)); y points upwards.",
        )
    pairs = list(_list_pairs(robot, feet))
    return (
        *_report_points_below_feet(robot, feet, p),
        *_report_long_feet(robot, pairs, slides - centre[0], gaps - centre[1]),
        *_report_reversed_feet(robot, pairs, slides),
        *_report_reversed_arming(robot, q, slides, p),
    )


def is_armed_behind(robot: PlanarRobot, name: str, values: Mapping[str, float]) -> bool:
    """Return whether a contact is armed only where it is behind the contact with which the mirror exchanges it.

    Examples
    --------
    >>> from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
    >>> is_armed_behind(flat_foot_walker(), "heel A", flat_foot_walker().resolve({}))
    False
    """
    q, p = _sample_poses(robot), robot.vector({**values, "slope": 0.0})
    slides = np.array(robot.gaps.map(POSES)(q, ca.repmat(ca.DM(p), 1, POSES))[1])
    return robot.contact_names.index(name) in _find_reversed_arming(robot, q, slides, p)


def _sample_poses(robot: PlanarRobot) -> NDArray[np.float64]:
    """Return poses with small angles and with lengths of about 0.8 m, shape (n_q, POSES)."""
    rng = np.random.default_rng(0)
    angles = np.array([unit == "rad" for unit in robot.units])[:, None]
    shape = robot.n_q, POSES
    return np.where(angles, rng.uniform(-SWING, SWING, shape), rng.uniform(0.7, 0.9, shape))


def _measure_centre(robot: PlanarRobot, q: NDArray[np.float64], values: Mapping[str, float]) -> NDArray[np.float64]:
    """Return the centre of mass in each pose [m], shape (2, POSES), from the energy of gravity along x and along y."""
    rest, rows = np.zeros(robot.n_q), []
    for slope, sign in ((math.pi / 2, -1.0), (0.0, 1.0)):
        p = robot.vector({**values, "slope": slope})
        weight = float(robot.mass(p)) * values["gravity"]
        energies = [float(robot.energy(pose, rest, p)[1] - robot.force_powers(pose, rest, p)[0]) for pose in q.T]
        rows.append(sign * np.array(energies) / weight)
    return np.array(rows)


def _report_points_below_feet(robot: PlanarRobot, feet: list[int], p: NDArray[np.float64]) -> Iterator[str]:
    """Yield a sentence on the points of the robot that are below all feet in each of some upright poses."""
    names = [robot.contact_names[i] for i in feet]
    places = [i for i, point in enumerate(robot.points) if point not in robot.contact_names]
    depths = []
    for angle in UPRIGHT:
        q = np.where([unit == "rad" for unit in robot.units], angle, 0.8)
        heights = np.array(robot.figure(q, p))[1, places]
        depths.append(float(np.array(robot.gaps(q, p)[0]).ravel()[feet].min()) - heights)
    depth = np.min(depths, axis=0)
    below = [robot.points[place] for place, size in zip(places, depth, strict=True) if size > CLEAR]
    if below:
        yield (
            f"Robot {robot.name!r}: in upright poses, {' and '.join(map(repr, below))} of the robot "
            f"{'are' if len(below) > 1 else 'is'} at least {min(depth[depth > CLEAR]):.2g} m below all contacts of the "
            f"feet ({', '.join(names)}), and so below the ground if the robot stands on them: check the sign of the "
            "distance from ankle to sole; y points upwards."
        )


def _list_pairs(robot: PlanarRobot, feet: list[int]) -> Iterator[tuple[int, int]]:
    """Yield the pairs of contacts of one body."""
    for number, one in enumerate(feet):
        for other in feet[number + 1 :]:
            if robot.contacts[one].body and robot.contacts[one].body == robot.contacts[other].body:
                yield one, other


def _report_long_feet(
    robot: PlanarRobot, pairs: list[tuple[int, int]], x: NDArray[np.float64], y: NDArray[np.float64]
) -> Iterator[str]:
    """Yield a sentence for the first foot that is too long; the positions are those relative to the centre of mass."""
    names = robot.contact_names
    for one, other in pairs:
        length = float(np.median(np.hypot(x[one] - x[other], y[one] - y[other])))
        nearest = min(float(np.median(np.hypot(x[i], y[i]))) for i in (one, other))
        if length > LONGEST_FOOT * nearest:
            yield (
                f"Robot {robot.name!r}: the distance of {length:.4g} m between contacts {names[one]!r} and "
                f"{names[other]!r} of one body is implausible: the centre of mass is {nearest:.3g} m from one of them. "
                f"Lengths must be in m.{name_unit(length, 'm')}"
            )
            return


def _report_reversed_feet(
    robot: PlanarRobot, pairs: list[tuple[int, int]], slides: NDArray[np.float64]
) -> Iterator[str]:
    """Yield a sentence on the contacts named toe that are behind the contact named heel of their body."""
    names, reversed_feet = robot.contact_names, list[str]()
    for pair in pairs:
        heels, toes = ([i for i in pair if word in names[i].lower()] for word in ("heel", "toe"))
        if len(heels) == len(toes) == 1 and np.all(slides[toes[0]] < slides[heels[0]] - CLEAR):
            reversed_feet.append(f"contact {names[toes[0]]!r} is behind {names[heels[0]]!r}")
    if reversed_feet:
        yield (
            f"Robot {robot.name!r}: {' and '.join(reversed_feet)}, but the robot walks in the direction of x: "
            "check the direction from heel to toe, such as (cos(angle), sin(angle)), and the signs of the distances."
        )


def _report_reversed_arming(
    robot: PlanarRobot, q: NDArray[np.float64], slides: NDArray[np.float64], p: NDArray[np.float64]
) -> Iterator[str]:
    """Yield a sentence on the contacts that are armed only behind the other leg."""
    names = ", ".join(repr(robot.contact_names[i]) for i in _find_reversed_arming(robot, q, slides, p))
    if names:
        yield (
            f"Robot {robot.name!r}: the expression `armed` of {names} is positive only where the contact is behind "
            "that of the other leg, but a foot lands ahead of the other one, in the direction of x: check the sign of "
            "the expression."
        )


def _find_reversed_arming(
    robot: PlanarRobot, q: NDArray[np.float64], slides: NDArray[np.float64], p: NDArray[np.float64]
) -> list[int]:
    """Return the contacts that are armed in some of the poses, and in all of them behind their mirrored contact."""
    if robot.mirror is None:
        return []
    rest = np.zeros((robot.n_q, POSES))
    armed = np.array(robot.arming.map(POSES)(q, rest, ca.repmat(ca.DM(p), 1, POSES))) > 0
    ahead = slides - slides[list(robot.mirror.contacts)]
    return [
        i
        for i, contact in enumerate(robot.contacts)
        if contact.conditional and robot.mirror.contacts[i] != i
        if np.any(armed[i]) and np.all(ahead[i][armed[i]] < CLEAR) and np.any(ahead[i][~armed[i]] > CLEAR)
    ]
