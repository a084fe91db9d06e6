"""Where an optimisation starts."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.solution import Solution
from gaitopt.motion.word import Word
from gaitopt.ocp.reach import touchdown_pose


@dataclass(frozen=True, eq=False)
class Sample:
    """A guessed step at given instants.

    Attributes
    ----------
    angles, rates : (n_angles, K) arrays [rad, rad/s]
    torque : (n_u, K) array [N m]
    slide, slide_rate : (K,) arrays [m, m/s]
        Foot displacement and velocity.
    """

    angles: Array
    rates: Array
    torque: Array
    slide: Array
    slide_rate: Array


@dataclass(frozen=True, eq=False)
class Setting:
    """What a guess is told about the problem: robot, parameter values, word, and wanted step [m] and period [s]."""

    robot: Robot
    values: Mapping[str, float]
    word: Word
    step: float
    period: float


class Guess(ABC):
    """A way to propose a step; derive from it to add another."""

    @abstractmethod
    def durations(self, setting: Setting) -> Array:
        """Return the duration of each phase, shape (n_phases,) [s]."""

    @abstractmethod
    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the guessed step at `time`, shape (K,) [s], from 0 to the sum of the durations."""

    @abstractmethod
    def describe(self) -> str:
        """Return the guess in words, for the record of the problem."""

    def solution_for(self, word: Word) -> Solution | None:
        """Return a solution to go on from with a word's unknowns and multipliers; None, as here, for a mere motion."""
        return None


def typical_durations(setting: Setting) -> Array:
    """Return a division of the period that gives each slip phase a sixth of it, shape (n_phases,) [s]."""
    weights = np.array([1.0 if mode.slips else 5.0 for mode in setting.word.phases])
    return setting.period * weights / weights.sum()


def _at_rest(robot: Robot, time: Array, angles: Array, rates: Array) -> Sample:
    still = np.zeros_like(time)
    return Sample(angles, rates, np.zeros((robot.n_u, time.size)), still, still)


@dataclass(frozen=True)
class Line(Guess):
    """Angles on a straight line from the pose after one touchdown to the pose at the next, without torque.

    Examples
    --------
    >>> Line().describe()
    'line'
    """

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the line."""
        start, end = _poses(setting)
        part = time / setting.period
        rates = np.repeat((end - start)[:, None] / setting.period, time.size, axis=1)
        return _at_rest(setting.robot, time, start[:, None] + (end - start)[:, None] * part, rates)

    def describe(self) -> str:
        """Return ``"line"``."""
        return "line"


@dataclass(frozen=True, eq=False)
class Keyframes(Guess):
    """Angles through poses at fractions of the step, monotone between them.

    Attributes
    ----------
    fractions : sequence of K floats
        Increasing, from 0 to 1.
    angles : mapping of angle name to sequence of K floats [rad]

    Raises
    ------
    InputError
        If the fractions do not run from 0 to 1, or lengths differ.

    Examples
    --------
    >>> Keyframes((0, 0.5, 1), {"th1": (-0.15, 0, 0.15), "th2": (-0.15, 0.1, 0.15)}).describe()
    'keyframes at 0, 0.5, 1'
    """

    fractions: Sequence[float]
    angles: Mapping[str, Sequence[float]]

    def __post_init__(self) -> None:
        f = np.asarray(self.fractions, dtype=float)
        if f.ndim != 1 or f.size < 2 or f[0] != 0 or f[-1] != 1 or not np.all(np.diff(f) > 0):
            raise InputError(f"Keyframes: fractions must increase from 0 to 1, got {list(self.fractions)}.")
        for name, angles in self.angles.items():
            if np.shape(angles) != f.shape or not np.all(np.isfinite(angles)):
                raise InputError(f"Keyframes: {name} needs {f.size} finite angles, got {list(angles)}.")

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the interpolated keyframes."""
        if set(self.angles) != set(setting.robot.angles):
            raise InputError(f"Keyframes must name the angles {setting.robot.angles}, got {tuple(self.angles)}.")
        part = np.clip(time / setting.period, 0, 1)
        curves = [PchipInterpolator(self.fractions, self.angles[name]) for name in setting.robot.angles]
        angles = np.array([curve(part) for curve in curves])
        rates = np.array([curve(part, 1) / setting.period for curve in curves])
        return _at_rest(setting.robot, time, angles, rates)

    def describe(self) -> str:
        """Return the keyframes' fractions in words."""
        return "keyframes at " + ", ".join(f"{f:g}" for f in self.fractions)


@dataclass(frozen=True, eq=False)
class Previous(Guess):
    """The first step of any earlier motion, stretched in time and spread over the phases of the new word.

    Attributes
    ----------
    motion : Motion
    label : str
        Where the motion came from, for the record.

    Examples
    --------
    >>> from gaitopt import load
    >>> Previous(load("docs/examples/compass_slip.h5").motion, label="the gait of the README").describe()
    'the gait of the README'
    """

    motion: Motion = field(repr=False)
    label: str = "a previous motion"

    def __post_init__(self) -> None:
        if not isinstance(self.motion, Motion):
            hint = " Use Continued(gait) to go on from a gait." if isinstance(self.motion, Gait) else ""
            raise InputError(f"Previous needs a Motion, got {type(self.motion).__name__}.{hint}")

    def durations(self, setting: Setting) -> Array:
        """Return the motion's own durations if its word has the same phases, else typical ones."""
        segments = self._segments()
        if tuple(s.mode for s in segments) == setting.word.phases:
            own = np.array([s.duration for s in segments])
            return own * setting.period / own.sum()
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the motion at the same fractions of its own period."""
        if self.motion.angles != setting.robot.angles:
            raise InputError(
                f"The guess is a motion of {self.motion.angles}, but the robot has {setting.robot.angles}."
            )
        segments = self._segments()
        clock = np.concatenate([s.time for s in segments]) - segments[0].time[0]
        clock, unique = np.unique(clock, return_index=True)
        at = time * clock[-1] / setting.period

        def channel(name: str) -> Array:
            values = np.concatenate([getattr(s, name) for s in segments], axis=-1)[..., unique]
            return np.array([np.interp(at, clock, row) for row in values]).reshape(-1, time.size)

        q, v, torque = channel("q"), channel("v"), channel("torque")
        return Sample(q[2:], v[2:], torque, q[0] - q[0, 0], v[0])

    def describe(self) -> str:
        """Return the label."""
        return self.label

    def _segments(self) -> list:
        first = self.motion.segments[0].step
        return [segment for segment in self.motion.segments if segment.step == first]


@dataclass(frozen=True, eq=False)
class Continued(Guess):
    """A gait solved before, from which the optimiser goes on with its unknowns and multipliers.

    Quickest from a gait whose problem differs a little; grid, method and impact may differ.  For a word with other
    phases only the motion is used, as by :class:`Previous`: carried from word to word, multipliers mislead.

    Attributes
    ----------
    gait : Gait
    label : str
        Where the gait came from, for the record.

    Examples
    --------
    >>> from gaitopt import load
    >>> Continued(load("docs/examples/compass_slip.h5")).describe()
    'a gait solved before'
    """

    gait: Gait = field(repr=False)
    label: str = "a gait solved before"

    def __post_init__(self) -> None:
        if not isinstance(self.gait, Gait):
            hint = " Use Previous(motion) to start from a motion." if isinstance(self.gait, Motion) else ""
            raise InputError(f"Continued needs a Gait, got {type(self.gait).__name__}.{hint}")

    def durations(self, setting: Setting) -> Array:
        """Return the gait's own durations if its word has the same phases, else typical ones."""
        return Previous(self.gait.motion).durations(setting)

    def solution_for(self, word: Word) -> Solution | None:
        """Return the solution to go on from, or None for a word with other phases."""
        return self.gait.solution if self.gait.word.phases == word.phases else None

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the gait's motion at the same fractions of its own period."""
        return Previous(self.gait.motion).sample(setting, time)

    def describe(self) -> str:
        """Return the label."""
        return self.label


@dataclass(frozen=True)
class Scattered(Guess):
    """A straight line with seeded random waves on the angles, to look for other optima from.

    Attributes
    ----------
    seed : int
    amplitude : float [rad]
        Size of the waves.

    Examples
    --------
    >>> Scattered(seed=3).describe()
    'scattered line, seed 3'
    """

    seed: int
    amplitude: float = 0.1

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the line and its waves, which vanish at both ends of the step."""
        line = Line().sample(setting, time)
        waves = np.arange(1, 4)
        generator = np.random.default_rng(self.seed)
        size = generator.normal(0, self.amplitude / waves, (len(setting.robot.angles), waves.size))
        phase = np.pi * waves[:, None] * time / setting.period
        angles = line.angles + size @ np.sin(phase)
        rates = line.rates + size @ (np.pi * waves[:, None] / setting.period * np.cos(phase))
        return _at_rest(setting.robot, time, angles, rates)

    def describe(self) -> str:
        """Return the seed in words."""
        return f"scattered line, seed {self.seed}"


def _poses(setting: Setting) -> tuple[Array, Array]:
    """Return the angles after one touchdown and at the next, a step apart."""
    robot, p = setting.robot, setting.robot.vector(setting.values)
    end = touchdown_pose(robot, setting.values, setting.step)
    swapped = robot.swap(np.concatenate([[0.0, 0.0], end]), np.zeros(robot.n_q), p)[0]
    return np.asarray(swapped).ravel()[2:], end
