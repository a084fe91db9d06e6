"""Points of walks on the section, and the natural size of a walker's motions."""

from typing import NamedTuple

import numpy as np

from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section


class SectionWalk(NamedTuple):
    """Points of a walk on the section.

    Attributes
    ----------
    points : (K, n_z) array
        The start and the state after each step.
    scale : (n_z,) array
        Natural size of each coordinate at the last point.
    """

    points: Array
    scale: Array


def take_walk(walker: Walker, section: Section, z: Array, steps: int) -> SectionWalk:
    """Return the walk from a point of the section, which ends early if a step does not reach its touchdown."""
    state, points = section.embed(z), [z]
    for _ in range(steps):
        following = walker.stride(state).following
        if following is None:
            break
        state = following
        points.append(section.project(state))
    return SectionWalk(np.array(points), natural_scale(walker, section, points[-1]))


def natural_rate(robot: Robot, p: Array) -> tuple[float, float]:
    """Return sqrt(g / l) [rad/s] and l [m], the height of the highest point drawn in the upright pose."""
    values = dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))
    height = float(np.max(np.asarray(robot.figure(np.zeros(robot.n_q), p))[1]))
    return float(np.sqrt(values["gravity"] / height)), height


def natural_scale(walker: Walker, section: Section, z: Array) -> Array:
    """Return the size of each coordinate in a pendulum-like motion with the step size of a point, shape (n_z,)."""
    n, state = walker.robot.n_q, section.embed(z)
    natural, height = natural_rate(walker.robot, walker.p)
    angle = abs(state[section.dependent_entry])
    units = [1.0] * (n - 3) + [natural] * (n - 2) + [natural * height] * section.sliding
    return angle * np.array(units)
