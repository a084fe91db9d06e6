"""Poses at touchdown: the longest possible step, and the pose for a step length."""

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time
from gaitopt.model.coordinate_entries import ANGLES, full_coordinates
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.model.uneven_ground import height_of_footprints, is_on_uneven_ground
from gaitopt.motion.motion import Array

REFINED = 3
"""Number of lattice points from which the longest reach is refined."""

MOST_STEPS, LONGEST_CHANGE = 20, 0.2
"""Largest number of steps of Newton's method, which fails near the longest reach, and of a change of angles [rad]."""

FLAT, DIFFERENCE = 1e-9, 1e-5
"""Derivative [m/rad] and curvature [m/rad^2] of the reach that count as zero; difference of angles [rad]."""

MOST_ANGLES = 7
"""Largest number of angles for a lattice of three values each; with more angles the points are random."""


def find_longest_reach(robot: Robot, values: Mapping[str, float], limits: Sequence[tuple[float, float]]) -> float:
    """Return the largest step [m] with angles within their bounds [rad]: the distance between the feet.

    For round feet it is the distance between their slide coordinates, by which a step without slip moves the walker
    forward.
    """
    return _reach(robot, _positions_of_feet(robot, values), tuple(limits))


def reaches(robot: Robot, values: Mapping[str, float], limits: Sequence[tuple[float, float]], step: float) -> bool:
    """Return whether a step [m] is possible with angles within their bounds [rad]; see :func:`find_longest_reach`."""
    p, box = _positions_of_feet(robot, values), tuple(limits)
    # The pose at touchdown is the start of most guesses; uneven ground has no slope between footprints without travel.
    pose = _pose_by_newton(robot, p, step) if step > 0 else None
    if pose is not None and all(lower <= angle <= upper for angle, (lower, upper) in zip(pose, box, strict=True)):
        return True
    return step <= _sample_reach(robot, p, box) or step <= _reach(robot, p, box)


def _positions_of_feet(robot: Robot, values: Mapping[str, float]) -> tuple[float, ...]:
    """Return the parameter vector, with zeros for parameters without effect on the position of the landing foot.

    Poses are kept for these parameters, so that none is computed again for another mass or friction.
    """
    p = robot.vector(values)
    return tuple(p) if is_on_uneven_ground(robot) else tuple(np.where(_affects_feet(robot), p, 0.0).tolist())


@functools.lru_cache(maxsize=256)
def _affects_feet(robot: Robot) -> Array:
    """Return which parameters affect the position of the landing foot or the touchdown guard, shape (n_p,)."""
    affects, place_or_guard, p = np.zeros(len(robot.parameters), dtype=bool), 0, 2  # numbers of output and input
    for function in (robot.landing, robot.touchdown):
        affects[function.jac_sparsity(place_or_guard, p).get_triplet()[1]] = True
    return affects


@functools.lru_cache(maxsize=256)
def _sample_reach(robot: Robot, p: tuple[float, ...], limits: tuple[tuple[float, float], ...]) -> float:
    """Return the largest distance between the feet at the points of the box of angles [m]."""
    return float(np.nanmax(_sample_distances(robot, p, limits)[1]))


@functools.lru_cache(maxsize=256)
@one_at_a_time
def _sample_distances(
    robot: Robot, p: tuple[float, ...], limits: tuple[tuple[float, float], ...]
) -> tuple[Array, Array]:
    """Return points of the box of angles, shape (n_points, n_angles), and the distance between the feet there [m]."""
    lower, upper = np.clip(limits, -np.pi, np.pi).T
    if len(limits) <= MOST_ANGLES:
        points = np.array(list(itertools.product(*zip(lower, (lower + upper) / 2, upper, strict=True))))
    else:
        points = np.random.default_rng(0).uniform(lower, upper, size=(3**MOST_ANGLES, len(limits)))
    landing, still = FastCall(robot.landing, p), np.zeros(robot.n_q)
    distances = np.array([landing(q, still)[0][0] for q in full_coordinates(points.T).T])
    if not np.any(np.isfinite(distances)):
        raise InputError(
            f"Robot {robot.name!r}: the position of the landing foot is not finite within Limits.angle; correct the "
            "robot or its parameters."
        )
    return points, np.where(np.isfinite(distances), distances, np.nan)


@functools.lru_cache(maxsize=256)
def _reach(robot: Robot, p: tuple[float, ...], limits: tuple[tuple[float, float], ...]) -> float:
    """Return the maximum over the box of angles, locally refined from the best points of a lattice.

    The distance is a sum of sines, and of angles if the feet are round.  Its extremes over absolute angles within 90
    degrees lie at the corners of the box, those over relative angles, such as that of a knee, anywhere in it.
    """
    points, distances = _sample_distances(robot, p, limits)
    order = np.argsort(-np.where(np.isfinite(distances), distances, -np.inf))
    landing, still = FastCall(robot.landing, p), np.zeros(robot.n_q)

    def reach(angles: Array) -> tuple[float, Array]:
        place, _, jacobian = landing(full_coordinates(angles), still)
        return float(place[0]), jacobian.reshape((2, -1), order="F")[0, ANGLES].copy()

    box = np.clip(limits, -np.pi, np.pi)
    return float(np.nanmax([distances[order[0]], *(_climb(reach, points[k], box) for k in order[:REFINED])]))


def _climb(function: Callable[[Array], tuple[float, Array]], x: Array, box: Array) -> float:
    """Return a local maximum of a function (value, gradient) in a box by Newton's method, uphill where it is convex.

    Parameters
    ----------
    function : callable
    x : (n,) array
    box : (n, 2) array
    """
    (lower, upper), (value, gradient) = box.T, function(x)
    for _ in range(MOST_STEPS):
        free = np.flatnonzero(((x > lower) | (gradient > 0)) & ((x < upper) | (gradient < 0)))
        if not np.max(np.abs(gradient[free]), initial=0.0) > FLAT:
            break
        change, hessian = np.zeros_like(x), _hessian(function, x)[np.ix_(free, free)]
        if not np.all(np.isfinite(hessian)):
            break
        curvatures, axes = np.linalg.eigh(hessian)
        change[free] = axes @ ((axes.T @ gradient[free]) / np.maximum(np.abs(curvatures), FLAT))
        change *= min(1.0, np.pi / np.max(np.abs(change)))
        for _ in range(MOST_STEPS):
            trial = np.clip(x + change, lower, upper)
            trial_value, trial_gradient = function(trial)
            if trial_value > value:
                break
            change /= 2
        else:
            break
        x, value, gradient = trial, trial_value, trial_gradient
    return value


def _hessian(function: Callable[[Array], tuple[float, Array]], x: Array) -> Array:
    """Return the Hessian of a function by differences of its gradients."""
    shifts = DIFFERENCE * np.eye(x.size)
    rows = np.array([function(x + shift)[1] - function(x - shift)[1] for shift in shifts]) / (2 * DIFFERENCE)
    return (rows + rows.T) / 2


def touchdown_pose(robot: Robot, values: Mapping[str, float], step: float) -> Array:
    """Return the angles at touchdown with the feet (their slide coordinates) `step` apart, shape (n_angles,) [rad].

    Raises
    ------
    InputError
        If no such pose is found.
    """
    angles = _pose(robot, _positions_of_feet(robot, values), step)
    if angles is None:
        raise InputError(
            f"Robot {robot.name!r} has no touchdown pose with a step length of {step:g} m; choose another step length."
        )
    return np.array(angles)


@functools.lru_cache(maxsize=256)
def _pose(robot: Robot, p: tuple[float, ...], step: float) -> tuple[float, ...] | None:
    angles = _pose_by_newton(robot, p, step)
    if angles is not None:
        return angles
    gaps = _Gaps(robot, p, step)
    if not gaps.are_finite(gaps.start):
        return None
    import scipy.optimize  # whose import takes longer than a solve

    tolerances = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14)
    fit = scipy.optimize.least_squares(lambda x: gaps(x)[0], gaps.start, lambda x: gaps(x)[1], **tolerances)
    return tuple(fit.x) if np.max(np.abs(fit.fun)) <= 1e-6 else None


@functools.lru_cache(maxsize=256)
def _pose_by_newton(robot: Robot, p: tuple[float, ...], step: float) -> tuple[float, ...] | None:
    """Return the angles at touchdown; None if Newton's method does not converge.

    It takes the smallest changes of the angles, since the pose of more than two angles is not unique.
    """
    gaps = _Gaps(robot, p, step)
    angles = gaps.start
    gap, slopes = gaps(angles)
    for _ in range(MOST_STEPS):
        if not (np.all(np.isfinite(gap)) and np.all(np.isfinite(slopes))):
            return None
        change = np.linalg.lstsq(slopes, gap, rcond=1e-10)[0]
        angles = angles - change * min(1.0, LONGEST_CHANGE / max(np.max(np.abs(change)), 1e-300))
        gap, slopes = gaps(angles)
        if np.max(np.abs(gap)) <= 1e-14 * max(1.0, step):
            return tuple(angles.tolist())
    return None


class _Gaps:
    """Distances of the landing foot and of the touchdown guard from a pose at touchdown, as a function of the angles.

    Attributes
    ----------
    start : (n_angles,) array [rad]
    """

    def __init__(self, robot: Robot, p: tuple[float, ...], step: float) -> None:
        self._still, self._units = np.zeros(robot.n_q), np.eye(robot.n_q)[ANGLES]
        self._landing, self._touchdown = FastCall(robot.landing, p), FastCall(robot.touchdown, p)
        level = float(height_of_footprints(robot, np.array(p), step, step)) if is_on_uneven_ground(robot) else 0.0
        self._place, self.start = (step, level), np.full(len(self._units), 0.1)

    def __call__(self, angles: Array) -> tuple[Array, Array]:
        """Return the distances, shape (3,), and their derivatives."""
        q = full_coordinates(angles)
        rates = [self._touchdown(q, unit)[1][0] for unit in self._units]  # of the guard, for units of angular rates
        guard, ((x, y), _, jacobian) = self._touchdown(q, self._still)[0][0], self._landing(q, self._still)
        slopes = np.vstack([jacobian.reshape((2, -1), order="F")[:, ANGLES], rates])
        return np.array([x - self._place[0], y - self._place[1], guard]), slopes

    def are_finite(self, angles: Array) -> bool:
        """Return whether distances and derivatives are finite."""
        return all(bool(np.all(np.isfinite(part))) for part in self(angles))
