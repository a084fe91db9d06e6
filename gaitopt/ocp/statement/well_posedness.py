"""Well-posedness of slip over all poses of a robot: whether Painleve's paradox is possible within its limits."""

import functools

import numpy as np

from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array

POSES = 1024
"""Number of poses at which the sliding inertia is computed."""

SAMPLING_MARGIN = 0.2
"""Distance from the margin within which the sliding inertia is constrained, to include minima between sampled poses."""


def allows_paradox(robot: Robot, values: dict[str, float], angles: list[tuple[float, float]], margin: float) -> bool:
    """Return whether slip comes near Painleve's paradox at some pose within the limits of the angles.

    Otherwise the constraint on the sliding inertia is never active, and the NLP does not contain it.

    Parameters
    ----------
    robot : Robot
    values : dict
        Every parameter by name.
    angles : list of (float, float)
        Bounds of the angles [rad].
    margin : float
        Least sliding inertia, :attr:`gaitopt.Margins.sliding_inertia`.
    """
    return _least_sliding_inertia(robot, robot.vector(values).tobytes(), tuple(angles)) <= margin + SAMPLING_MARGIN


@functools.lru_cache(maxsize=256)
def _least_sliding_inertia(robot: Robot, p: bytes, angles: tuple[tuple[float, float], ...]) -> float:
    """Return the least of (S_tt - mu |S_tn|) / S_tt over sampled poses, nan as -inf."""
    lower, upper = np.array(angles).T[:, :, None]
    poses: Array = np.zeros((robot.n_q, POSES))
    poses[2:] = np.random.default_rng(0).uniform(lower, upper, (len(angles), POSES))
    function = robot.wellposed.map("wellposed", "serial", POSES, [1], [])  # all poses have the same parameters
    shares = FastCall(function)(poses.ravel(order="F"), np.frombuffer(p))[0].reshape(2, POSES, order="F")
    ratios = shares / shares.mean(axis=0)
    return float(np.nan_to_num(ratios, nan=-np.inf).min())
