"""Coordinates that move the whole robot along the ground but are not declared as its travel."""

from collections.abc import Mapping

import numpy as np

from gaitopt.model.planar.planar_robot import PlanarRobot

EXACT = 1e-9
"""Largest error of gaps, slide coordinates and momentum, relative to their sizes."""


def find_undeclared_travel(robot: PlanarRobot, values: Mapping[str, float]) -> str | None:
    """Return the coordinate by which a robot without declared travel moves along the ground; None without any.

    Such a coordinate changes no gap, every slide coordinate by its own change, and the momentum along the ground by the
    total mass times its rate.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        Values of all parameters.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> find_undeclared_travel(monopod(), monopod().resolve({})) is None  # its travel, x, is declared
    True
    """
    slides = np.array([contact.slides for contact in robot.contacts])
    if robot.travel is not None or not slides.any():
        return None
    p, rng = np.asarray(robot.vector(dict(values)), dtype=float), np.random.default_rng(0)
    poses, mass = rng.uniform(0.2, 0.8, (2, robot.n_q)), float(robot.mass(p))
    for name, unit, direction in zip(robot.coordinates, robot.units, np.eye(robot.n_q), strict=True):
        if unit == "m" and all(_moves_along(robot, pose, direction, slides, p, mass) for pose in poses):
            return name
    return None


def _moves_along(
    robot: PlanarRobot, q: np.ndarray, direction: np.ndarray, slides: np.ndarray, p: np.ndarray, mass: float
) -> bool:
    """Return whether a coordinate moves contacts and centre of mass of a robot along the ground, by its own change."""
    before, after = (robot.gaps(place, p) for place in (q, q + direction))
    gaps, places = (np.array(b - a).ravel() for a, b in zip(before, after, strict=True))
    momentum = np.array(robot.momentum(q, direction, p)[0]).ravel()
    return (
        np.allclose(gaps, 0.0, atol=EXACT)
        and np.allclose(places[slides], 1.0, atol=EXACT)
        and np.allclose(momentum, [mass, 0.0], atol=EXACT * max(mass, 1.0))
    )


def state_undeclared_travel(robot: PlanarRobot, values: Mapping[str, float]) -> str:
    """Return that the travel of a robot is not declared, with the line that declares it; empty if it is, or has none.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        Values of all parameters.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> state_undeclared_travel(vertical_hopper(), vertical_hopper().resolve({}))
    ''
    """
    name = find_undeclared_travel(robot, values)
    if name is None:
        return ""
    names = ", ".join(repr(each) for each in robot.coordinates)
    return (
        f"Robot {robot.name!r}: coordinate {name!r} moves the whole robot along the ground, but is not declared as its "
        f"travel, so that it must return to its initial value in every period: declare it by "
        f"PlanarCoordinates(({names}), ..., travel={name!r})"
    )
