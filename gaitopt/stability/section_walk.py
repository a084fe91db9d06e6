"""Points of walks on the section, and the natural size of a walker's motions."""

import functools
from typing import NamedTuple

import numpy as np

from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.return_map import Passage
from gaitopt.stability.section import Section


class SectionWalk(NamedTuple):
    """A walk from a point of the section.

    Attributes
    ----------
    points : (K, n_z) array
        The start and the point after each step.
    first : Passage
        The first step.
    """

    points: Array
    first: Passage


def take_walk(walker: Walker, section: Section, z: Array, steps: int) -> SectionWalk:
    """Return a walk of at least one step from a point of the section.

    The walk ends early if a step does not reach its touchdown.
    """
    start = section.embed(z)
    walk_step = walker.walk_step(start)
    points, following = [z], walk_step.following
    while following is not None:
        points.append(section.project(following))
        following = walker.walk_step(following).following if len(points) <= steps else None
    return SectionWalk(np.array(points), Passage(points[1] if len(points) > 1 else None, (start,), (walk_step,)))


def natural_rate(robot: Robot, p: Array) -> tuple[float, float]:
    """Return sqrt(g / l) [rad/s] and l [m], the height of the highest point drawn in the upright pose."""
    return _natural_rate(robot, p.tobytes())


@functools.lru_cache(maxsize=256)
def _natural_rate(robot: Robot, vector: bytes) -> tuple[float, float]:
    p = np.frombuffer(vector)
    values = dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))
    height = float(np.max(np.asarray(robot.figure(np.zeros(robot.n_q), p))[1]))
    return float(np.sqrt(values["gravity"] / height)), height


def natural_scale(walker: Walker, section: Section, z: Array) -> Array:
    """Return the size of each coordinate in a pendulum-like motion with the step size of a point, shape (n_z,)."""
    count, state = len(walker.robot.angles), section.embed(z)
    natural, height = natural_rate(walker.robot, walker.p)
    angle = abs(state[section.dependent_entry])
    units = [1.0] * (count - 1) + [natural] * count + [natural * height] * section.sliding
    return angle * np.array(units)
