"""Initial guesses for the gaits of planar robots: poses at the events, keyframes, and earlier gaits."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from attrs import frozen

from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.phase_sequence import PhaseSequence

TYPICAL_SPEED = 0.5
"""Speed [m/s] of the guess if neither speed nor period is known."""
SPREAD = 1e-3
"""Weight of the distance from the reference pose in the search of the poses of a step."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarSetting:
    """Data of a problem for its guess.

    Attributes
    ----------
    robot : PlanarRobot
    values : mapping of str to float
    sequence : PhaseSequence
    bounds : (n_q, 2) array
        Bounds of the coordinates.
    step_length : float [m]
    period : float [s]
    """

    robot: PlanarRobot
    values: Mapping[str, float]
    sequence: PhaseSequence
    bounds: Array
    step_length: float
    period: float


class PlanarGuess(ABC):
    """Base class of the initial guesses of a gait; a subclass defines a custom guess."""

    @abstractmethod
    def durations(self, setting: PlanarSetting) -> Array:
        """Return the duration of each phase, shape (n_phases,) [s]."""

    @abstractmethod
    def sample(self, setting: PlanarSetting, time: Array) -> tuple[Array, Array]:
        """Return the coordinates and their rates at `time`, shape (n_q, K) each."""

    @abstractmethod
    def describe(self) -> str:
        """Return a text that describes the guess, for the record of the problem."""


def typical_durations(setting: PlanarSetting) -> Array:
    """Return durations of the phases; a phase with a slipping contact is a fifth of another one."""
    slips = [any(mode.slips for _, mode in modes) for modes in setting.sequence.phases]
    weights = np.where(slips, 1.0, 5.0)
    return setting.period * weights / weights.sum()


@frozen
class PoseGuess(PlanarGuess):
    """A straight line from the pose after one period's end to the next one.

    The poses have the closed contacts on the ground and are nearest to the reference pose: the middle of the bounds of
    each coordinate, or zero.

    Examples
    --------
    >>> PoseGuess().describe()
    'line between poses'
    """

    def durations(self, setting: PlanarSetting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: PlanarSetting, time: Array) -> tuple[Array, Array]:
        """Return the line."""
        first, last = find_poses(setting)
        rates = (last - first)[:, None] / setting.period
        return first[:, None] + rates * time, np.repeat(rates, time.size, axis=1)

    def describe(self) -> str:
        """Return ``"line between poses"``."""
        return "line between poses"


@dataclass(frozen=True, eq=False)
class PlanarKeyframes(PlanarGuess):
    """Coordinates at given times, monotone between them.

    Attributes
    ----------
    times : sequence of K floats [s]
        Increasing from 0.
    coordinates : mapping of coordinate to sequence of K floats
        All coordinates of the robot.
    phases : sequence of float, optional
        Duration of each phase [s]; by default the last time is divided typically.

    Raises
    ------
    InputError
        If the times do not increase from 0, or lengths differ.

    Examples
    --------
    >>> PlanarKeyframes((0, 0.2, 0.4), {"y": (0.5, 0.45, 0.5)}).describe()
    'keyframes at 0, 0.2, 0.4 s'
    """

    times: Sequence[float]
    coordinates: Mapping[str, Sequence[float]]
    phases: Sequence[float] | None = None

    def __post_init__(self) -> None:
        times = np.asarray(self.times, dtype=float)
        if times.ndim != 1 or times.size < 2 or times[0] != 0 or not np.all(np.diff(times) > 0):
            raise InputError(f"PlanarKeyframes: times must increase from 0, got {list(self.times)}.")
        for name, values in self.coordinates.items():
            if np.shape(values) != times.shape or not np.all(np.isfinite(values)):
                raise InputError(f"PlanarKeyframes: {name} needs {times.size} finite values, got {list(values)}.")

    def durations(self, setting: PlanarSetting) -> Array:
        """Return the durations of the phases."""
        if self.phases is None:
            return typical_durations(setting) * self.times[-1] / setting.period
        if len(self.phases) != len(setting.sequence.phases):
            raise InputError(
                f"PlanarKeyframes: the sequence '{setting.sequence}' has {len(setting.sequence.phases)} phases, "
                f"got {len(self.phases)} durations."
            )
        return np.array(self.phases, dtype=float)

    def sample(self, setting: PlanarSetting, time: Array) -> tuple[Array, Array]:
        """Return the interpolated keyframes."""
        names = setting.robot.coordinates
        if set(self.coordinates) != set(names):
            raise InputError(f"PlanarKeyframes must name the coordinates {names}, got {tuple(self.coordinates)}.")
        interpolate = scipy.interpolate.PchipInterpolator  # SciPy imports its parts when they are used
        part = np.clip(time, 0, self.times[-1])
        curves = [interpolate(self.times, self.coordinates[name]) for name in names]
        return np.array([curve(part) for curve in curves]), np.array([curve(part, 1) for curve in curves])

    def describe(self) -> str:
        """Return a text with the times of the keyframes."""
        return "keyframes at " + ", ".join(f"{t:g}" for t in self.times) + " s"


def find_poses(setting: PlanarSetting) -> tuple[Array, Array]:
    """Return the coordinates at the beginning and at the end of a period.

    The contacts that are closed there are on the ground, those that are closed throughout do not move, and the second pose
    becomes the first one by the exchange of the legs, a step further.
    """
    robot, p = setting.robot, setting.robot.vector(setting.values)
    mirror = np.eye(robot.n_q) if robot.mirror is None else robot.mirror.coordinates
    shift = np.zeros(robot.n_q)
    if robot.travel is not None:
        shift[robot.coordinates.index(robot.travel)] = setting.step_length
    reference = _reference_pose(setting)
    states = setting.sequence.states(robot)
    final = setting.sequence.outcome(robot, len(states) - 1) if setting.sequence.events[-1].impact else states[-1]
    start, end = _closed(states[0]), sorted({*_closed(final), *_closed(states[-1])})
    still = [i for i in start if all(i in _closed(state) for state in states)]

    def poses(last: Array) -> tuple[Array, Array]:
        first = mirror @ last
        if robot.travel is not None:
            place = robot.coordinates.index(robot.travel)
            first[place] = last[place] - setting.step_length
        return first, last

    def misfit(last: Array) -> Array:
        before, after = poses(last)
        (gap_before, slide_before), (gap_after, slide_after) = (
            [np.asarray(part).ravel() for part in robot.gaps(q, p)] for q in (before, after)
        )
        moved = slide_after[still] - slide_before[still]
        return np.concatenate([gap_before[start], gap_after[end], moved, SPREAD * (last - reference)])

    solution = scipy.optimize.least_squares(misfit, reference + shift)
    first, last = poses(solution.x)
    if robot.travel is not None:
        place = robot.coordinates.index(robot.travel)
        last[place] -= first[place]
        first[place] = 0.0
    return first, last


def _reference_pose(setting: PlanarSetting) -> Array:
    """Return the middle of the bounds of each coordinate, and zero for unbounded ones."""
    lower, upper = setting.bounds.T
    middle = (np.where(np.isfinite(lower), lower, 0) + np.where(np.isfinite(upper), upper, 0)) / 2
    return np.where(np.isfinite(lower) & np.isfinite(upper), middle, np.clip(0.0, lower, upper))


def _closed(state: ContactState) -> list[int]:
    return [i for i, (_, mode) in enumerate(state.modes) if mode is not Mode.FREE]
