"""Well-posedness of slip over all poses of a robot: whether Painleve's paradox is possible within its limits."""

import functools

import numpy as np

from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array

POSES, BATCH = 1024, 64
"""Numbers of poses at which the sliding inertia is computed, in total and in a batch: large maps take long to build."""

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
    poses = full_coordinates(lower + (upper - lower) * _shares_of_ranges(len(angles)))
    function = robot.wellposed.map("wellposed", "serial", BATCH, [1], [])  # all poses have the same parameters
    evaluate = FastCall(function, np.frombuffer(p))
    parts = np.split(poses.ravel(order="F"), POSES // BATCH)
    shares = np.concatenate([evaluate(part)[0].copy() for part in parts]).reshape(2, POSES, order="F")
    ratios = shares / shares.mean(axis=0)
    return float(np.nan_to_num(ratios, nan=-np.inf).min())


@functools.cache
def _shares_of_ranges(count: int) -> Array:
    """Return numbers between 0 and 1 for each angle and pose that fill the unit cube evenly, shape (count, POSES).

    They are an additive recurrence with the powers of the root of g**(count + 1) = g + 1, the golden ratio for one
    angle; the import of NumPy's random numbers would take several milliseconds.
    """
    ratio = 2.0
    for _ in range(100):  # a contraction
        ratio = (1.0 + ratio) ** (1.0 / (count + 1))
    return np.outer(ratio ** -np.arange(1.0, count + 1), np.arange(1.0, POSES + 1)) % 1.0
