"""Initial guesses for the gaits of planar robots: poses at the events, keyframes, and earlier gaits."""

import functools
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from attrs import frozen

from gaitopt.arguments import check_arguments, check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.motion.printable import format_count

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


class PlanarSample(NamedTuple):
    """A guessed motion at K instants of a phase.

    Attributes
    ----------
    q, v : (n_q, K) arrays
        Coordinates and their rates.
    torque : (n_u, K) array or None
        If it is known, accelerations and forces follow from the equations of motion; otherwise they are zero, except
        for the weight on the feet.

    Examples
    --------
    >>> PlanarSample(np.zeros((2, 3)), np.zeros((2, 3))).torque is None
    True
    """

    q: Array
    v: Array
    torque: Array | None = None


class PlanarGuess(ABC):
    """Base class of the initial guesses of a gait; a subclass defines a custom guess.

    Attributes
    ----------
    states_durations : bool
        Whether the guess states the durations of the phases.  The problem is then solved with these durations first.
    """

    states_durations: bool = False

    @property
    def parameters(self) -> Mapping[str, float]:
        """Initial values of free parameters (SI units); missing ones start from the values of the problem."""
        return {}

    @property
    def events(self) -> tuple[PlanarEvent, ...]:
        """Events whose impulses of actuators are initial values of the solve; empty if none are known."""
        return ()

    @abstractmethod
    def durations(self, setting: PlanarSetting) -> Array:
        """Return the duration of each phase, shape (n_phases,) [s]."""

    @abstractmethod
    def sample(self, setting: PlanarSetting, time: Array, phase: int) -> PlanarSample:
        """Return the motion at `time`, shape (K,) [s], from the start of the period, in a phase counted from 0."""

    @abstractmethod
    def describe(self) -> str:
        """Return a text that describes the guess, for the record of the problem."""


def typical_phase_durations(setting: PlanarSetting) -> Array:
    """Return durations of the phases; a phase with a slipping contact is a fifth of another one."""
    slips = [any(mode.slips for _, mode in modes) for modes in setting.sequence.phases]
    weights = np.where(slips, 1.0, 5.0)
    return setting.period * weights / weights.sum()


@check_arguments
@frozen
class PoseGuess(PlanarGuess):
    """A straight line from a pose at the beginning of the period to one at its end.

    The poses have the closed contacts on the ground and are nearest to the reference pose: the middle of the bounds of
    each coordinate, or zero.

    Examples
    --------
    >>> PoseGuess().describe()
    'linear guess between poses'
    """

    def durations(self, setting: PlanarSetting) -> Array:
        """Return typical durations."""
        return typical_phase_durations(setting)

    def sample(self, setting: PlanarSetting, time: Array, phase: int) -> PlanarSample:
        """Return the line."""
        first, last = find_poses(setting)
        rates = (last - first)[:, None] / setting.period
        return PlanarSample(first[:, None] + rates * time, np.repeat(rates, time.size, axis=1))

    def describe(self) -> str:
        """Return ``"linear guess between poses"``."""
        return "linear guess between poses"


@check_arguments
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
        Duration of each phase [s]; by default the last time is divided into typical durations.

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

    @property
    def states_durations(self) -> bool:  # type: ignore[override]
        """Whether the durations of the phases are stated."""
        return self.phases is not None

    def durations(self, setting: PlanarSetting) -> Array:
        """Return the durations of the phases."""
        if self.phases is None:
            return typical_phase_durations(setting) * self.times[-1] / setting.period
        if len(self.phases) != len(setting.sequence.phases):
            raise InputError(
                f"PlanarKeyframes: the sequence '{setting.sequence}' has "
                f"{format_count(len(setting.sequence.phases), 'phase')}, "
                f"got {format_count(len(self.phases), 'duration')}."
            )
        return np.array(self.phases, dtype=float)

    def sample(self, setting: PlanarSetting, time: Array, phase: int) -> PlanarSample:
        """Return the interpolated keyframes."""
        names = setting.robot.coordinates
        if set(self.coordinates) != set(names):
            raise InputError(f"PlanarKeyframes must name the coordinates {names}, got {tuple(self.coordinates)}.")
        interpolate = scipy.interpolate.PchipInterpolator  # SciPy imports its parts when they are used
        part = np.clip(time, 0, self.times[-1])
        curves = [interpolate(self.times, self.coordinates[name]) for name in names]
        return PlanarSample(*(np.array([curve(part, order) for curve in curves]) for order in (0, 1)))

    def describe(self) -> str:
        """Return a text with the times of the keyframes."""
        return "keyframes at " + ", ".join(f"{t:g}" for t in self.times) + " s"


@check_record
@dataclass(frozen=True, eq=False)
class FromPlanarGait(PlanarGuess):
    """The motion of an earlier gait, whose sequence may differ.

    If parameters and targets are within 10 % of those of the gait, and the sequence and the objective are the same, the
    solve begins on the refined grid of the gait, from all its unknowns and multipliers.

    Attributes
    ----------
    gait : PlanarGait

    Examples
    --------
    >>> FromPlanarGait.__name__
    'FromPlanarGait'
    """

    gait: PlanarGait

    @property
    def parameters(self) -> Mapping[str, float]:
        """Initial values of free parameters: those of the gait (SI units)."""
        return self.gait.motion.parameters

    @property
    def events(self) -> tuple[PlanarEvent, ...]:
        """Events of the gait, whose impulses of actuators are initial values of the solve."""
        return self.gait.motion.events

    def durations(self, setting: PlanarSetting) -> Array:
        """Return the durations of the gait's phases, or typical ones for another number of phases."""
        segments = self.gait.motion.segments
        if len(segments) != len(setting.sequence.phases):
            return typical_phase_durations(setting)
        return np.array([segment.time[-1] - segment.time[0] for segment in segments])

    def sample(self, setting: PlanarSetting, time: Array, phase: int) -> PlanarSample:
        """Return the interpolated motion."""
        motion, total = self.gait.motion, self.durations(setting)
        if len(motion.segments) == total.size:
            segment, start = motion.segments[phase], total[:phase].sum()
            at = segment.time[0] + np.clip(time - start, 0, total[phase])
            return PlanarSample(
                *(_interpolate(segment.time, part, at) for part in (segment.q, segment.v, segment.torque))
            )
        parts = [motion.channel(name) for name in ("time", "q", "v", "torque")]
        _, kept = np.unique(parts[0], return_index=True)
        at = time / total.sum() * motion.period
        return PlanarSample(*(_interpolate(parts[0][kept], part[:, kept], at) for part in parts[1:3]))

    def describe(self) -> str:
        """Return a text with the sequence of the gait."""
        return f"gait '{self.gait.sequence}'"


def _interpolate(time: Array, values: Array, at: Array) -> Array:
    curve: Array = scipy.interpolate.PchipInterpolator(time, values, axis=1)(at)
    return curve


@functools.lru_cache(maxsize=8)
def find_poses(setting: PlanarSetting) -> tuple[Array, Array]:
    """Return the coordinates at the beginning and at the end of a period.

    The contacts that are closed there are on the ground, those that are closed throughout do not move, and the exchange
    of the legs turns the second pose into the first one, a step further.
    """
    robot, p = setting.robot, setting.robot.vector(setting.values)
    mirror = np.eye(robot.n_q) if robot.mirror is None else robot.mirror.coordinates
    shift = np.zeros(robot.n_q)
    if robot.travel is not None:
        shift[robot.coordinates.index(robot.travel)] = setting.step_length
    reference = _reference_pose(setting)
    states = setting.sequence.states(robot)
    final = setting.sequence.outcome(robot, len(states) - 1) if setting.sequence.events[-1].impact else states[-1]
    start, end = _select_closed(states[0]), sorted({*_select_closed(final), *_select_closed(states[-1])})
    still = [i for i in start if all(i in _select_closed(state) for state in states)]

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


def _select_closed(state: ContactState) -> list[int]:
    return [i for i, (_, mode) in enumerate(state.modes) if mode is not Mode.FREE]
