"""Comparison of a motion with its terrain: the stance foot must be on the terrain, and the swing foot above it."""

import numpy as np

from gaitopt.model.coordinate_entries import CONTACT, GAP, SLIDE
from gaitopt.model.terrain import Piece, Terrain
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
    ahead of the stance foot.  Behind it, the straight legs of a walker without knees reach through the ground: only
    terrain above the ground of the previous foothold and that of the stance foot counts there.

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
    lift_off: dict[int, Piece] = {}
    for segment in motion.segments:
        feet = np.asarray(robot.landing.map(segment.time.size)(segment.q, 0, p)[0])
        left = lift_off.setdefault(segment.step, terrain.pieces[terrain.piece_at(feet[SLIDE, 0])])
        obstacle = _height_over_footholds(terrain, feet[SLIDE], (left, problem.ground[segment.step].piece))
        if not (passes_change(terrain, problem.ground, segment.step) or np.any(obstacle > 0)):
            continue
        ahead, below = feet[SLIDE] > segment.q[SLIDE] + 2 * PASSED, -_height(terrain, feet)
        depth = np.where(ahead, below, np.minimum(below, np.maximum(obstacle, 0.0)))
        if not worst(depth) <= max(SCUFF, scuffs.get(segment.step, (0.0, 0.0))[0]):
            scuffs[segment.step] = worst(depth), float(feet[SLIDE, int(np.argmax(depth))])
    return scuffs


def describe_contradictions(problem: MultiStepProblem, motion: Motion) -> list[str]:
    """Return how a motion contradicts its terrain, one sentence each; see :func:`find_scuffs`."""
    terrain = problem.terrain or Terrain()
    reasons = [
        f"the swing foot of steps[{step}] is up to {1e3 * depth:.2g} mm below the terrain, at {place:.3f} m"
        for step, (depth, place) in find_scuffs(problem, motion).items()
    ]
    for segment in motion.segments:
        if not worst(np.abs(_height(terrain, segment.q[CONTACT]))) <= ON_GROUND:
            reasons.append(f"the stance foot of steps[{segment.step}] leaves its piece of the terrain")
    for jump in motion.jumps:
        if not worst(np.abs(_height(terrain, jump.q_next[CONTACT][:, None]))) <= ON_GROUND:
            reasons.append(f"the touchdown of steps[{jump.step}] is not on the terrain")
    return reasons


def _height_over_footholds(terrain: Terrain, places: Array, pieces: tuple[Piece, Piece]) -> Array:
    """Return how far the terrain at some places, shape (K,), is above the extended ground of two footholds [m]."""
    lines = [level + grade * places for level, grade in (piece.line for piece in pieces)]
    return np.array([terrain.height(x) for x in places]) - np.maximum(*lines)


def _height(terrain: Terrain, places: Array) -> Array:
    """Return the heights of some places, shape (2, K), over the terrain [m]."""
    return np.asarray(places[GAP] - [terrain.height(x) for x in places[SLIDE]])
