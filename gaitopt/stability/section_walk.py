"""Points of walks on the section, and the natural size of a walker's motions."""

import functools

import numpy as np

from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section


def take_walk(walker: Walker, section: Section, z: Array, steps: int) -> Array:
    """Return the points of a walk on the section, the start and the state after each step, shape (K, n_z).

    The walk ends early if a step does not reach its touchdown.
    """
    state, points = section.embed(z), [z]
    for _ in range(steps):
        following = walker.stride(state).following
        if following is None:
            break
        state = following
        points.append(section.project(state))
    return np.array(points)


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
