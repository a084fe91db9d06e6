"""Comparison of a motion with its terrain: the stance foot must be on the terrain, and the swing foot above it."""

import numpy as np

from gaitopt.model.coordinate_entries import CONTACT, GAP, SLIDE
from gaitopt.model.terrain import Terrain
from gaitopt.model.uneven_ground import INCLINE, NEXT_INCLINE, PASSED
from gaitopt.motion.motion import Array, Motion
from gaitopt.ocp.multistep.foothold_ground import passes_change
from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
from gaitopt.reductions import worst

ON_GROUND, SCUFF = 1e-6, 1e-3
"""Largest accepted distance of a stance foot from the terrain, and depth of the swing foot below it [m]."""


def find_scuffs(problem: MultiStepProblem, motion: Motion) -> dict[int, tuple[float, float]]:
    """Return the largest depth of the swing foot below the terrain and its place [m], by step if it exceeds 1 mm.

    The swing foot is compared with the terrain in steps over a change of the height, while it is more than 10 cm
    ahead of the stance foot: behind it, the straight legs of a walker without knees reach through the ground.

    Parameters
    ----------
    problem : MultiStepProblem
        With a terrain.
    motion : Motion
        Positions along and across the plane, as :func:`gaitopt.ocp.multistep.multistep_gait.join_steps` returns them.
    """
    robot, terrain = problem.robot, problem.terrain or Terrain()
    p = robot.vector({**motion.parameters, INCLINE: 0.0, NEXT_INCLINE: 0.0})
    scuffs: dict[int, tuple[float, float]] = {}
    for segment in motion.segments:
        if not passes_change(terrain, problem.ground, segment.step):
            continue
        feet = np.asarray(robot.landing.map(segment.time.size)(segment.q, 0, p)[0])
        ahead = feet[SLIDE] > segment.q[SLIDE] + 2 * PASSED
        depth = np.where(ahead, -_height(terrain, feet), 0.0)
        if not worst(depth) <= max(SCUFF, scuffs.get(segment.step, (0.0, 0.0))[0]):
            scuffs[segment.step] = worst(depth), float(feet[SLIDE, int(np.argmax(depth))])
    return scuffs


def describe_contradictions(problem: MultiStepProblem, motion: Motion) -> list[str]:
    """Return how a motion contradicts its terrain, one sentence each; see :func:`find_scuffs`."""
    terrain = problem.terrain or Terrain()
    reasons = [
        f"the swing foot of step {step + 1} is up to {1e3 * depth:.2g} mm below the terrain, at {place:.3f} m"
        for step, (depth, place) in find_scuffs(problem, motion).items()
    ]
    for segment in motion.segments:
        if not worst(np.abs(_height(terrain, segment.q[CONTACT]))) <= ON_GROUND:
            reasons.append(f"the stance foot of step {segment.step + 1} leaves its piece of the terrain")
    for jump in motion.jumps:
        if not worst(np.abs(_height(terrain, jump.q_next[CONTACT][:, None]))) <= ON_GROUND:
            reasons.append(f"the touchdown of step {jump.step + 1} is not on the terrain")
    return reasons


def _height(terrain: Terrain, places: Array) -> Array:
    """Return the heights of some places, shape (2, K), over the terrain [m]."""
    return np.asarray(places[GAP] - [terrain.height(x) for x in places[SLIDE]])
