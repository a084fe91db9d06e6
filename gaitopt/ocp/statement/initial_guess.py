"""Initial guesses without an earlier motion: lines, keyframes, random perturbations."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES, full_coordinates
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.statement.touchdown_pose import touchdown_pose
from gaitopt.parameters import check_type, number_within, whole_number

LEAD, LAG = 0.1, 0.25
"""Sizes of the waves of a delayed swing [rad]."""


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
    """Data of a problem for its guess: robot, parameter values, sequence, step length [m] and period [s]."""

    robot: Robot
    values: Mapping[str, float]
    sequence: ContactSequence
    step_length: float
    period: float


class Guess(ABC):
    """Base class of the initial guesses of a step; a subclass defines a custom guess.

    Attributes
    ----------
    needs_coarse_grids : bool
        Whether the problem is solved on coarse grids first, which is the case unless a guess is accurate.
    """

    needs_coarse_grids: ClassVar[bool] = True

    @property
    def parameters(self) -> Mapping[str, float]:
        """Values from which free parameters start (SI units); those that are missing start from the problem's."""
        return {}

    @abstractmethod
    def durations(self, setting: Setting) -> Array:
        """Return the duration of each phase, shape (n_phases,) [s]."""

    @abstractmethod
    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the guessed step at `time`, shape (K,) [s], from 0 to the sum of the durations."""

    @abstractmethod
    def describe(self) -> str:
        """Return a text that describes the guess, for the record of the problem."""

    def solution_for(self, sequence: ContactSequence) -> Solution | None:
        """Return a solution with the unknowns and multipliers of a sequence, or None if the guess is only a motion."""
        return None


def typical_durations(setting: Setting) -> Array:
    """Return durations of the phases, a slip phase being a fifth of a sticking one, shape (n_phases,) [s]."""
    weights = np.array([1.0 if mode.slips else 5.0 for mode in setting.sequence.phases])
    return setting.period * weights / weights.sum()


def _at_rest(robot: Robot, time: Array, angles: Array, rates: Array) -> Sample:
    still = np.zeros_like(time)
    return Sample(angles, rates, np.zeros((robot.n_u, time.size)), still, still)


@check_arguments
@dataclass(frozen=True)
class LinearGuess(Guess):
    """The linear guess: angles on a straight line from the pose after one touchdown to the pose at the next, no torque.

    Examples
    --------
    >>> LinearGuess().describe()
    'linear guess'
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
        """Return ``"linear guess"``."""
        return "linear guess"


@check_arguments
@dataclass(frozen=True, eq=False)
class Keyframes(Guess):
    """Angles interpolated monotonically between poses at given fractions of the step.

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
        example = 'angles by name such as {"th1": [-0.15, 0, 0.15], "th2": [-0.15, 0.1, 0.15]}'
        check_type("Keyframes.angles", self.angles, Mapping, example)
        for name, angles in self.angles.items():
            if np.shape(angles) != f.shape or not np.all(np.isfinite(angles)):
                raise InputError(f"Keyframes: {name} needs {f.size} finite angles, got {list(angles)}.")

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the interpolated keyframes."""
        from scipy.interpolate import PchipInterpolator  # whose import takes longer than a solve

        if set(self.angles) != set(setting.robot.angles):
            raise InputError(f"Keyframes must name the angles {setting.robot.angles}, got {tuple(self.angles)}.")
        part = np.clip(time / setting.period, 0, 1)
        curves = [PchipInterpolator(self.fractions, self.angles[name]) for name in setting.robot.angles]
        angles = np.array([curve(part) for curve in curves])
        rates = np.array([curve(part, 1) / setting.period for curve in curves])
        return _at_rest(setting.robot, time, angles, rates)

    def describe(self) -> str:
        """Return a text with the fractions of the keyframes."""
        return "keyframes at " + ", ".join(f"{f:g}" for f in self.fractions)


@check_arguments
@frozen
class RandomPerturbation(Guess):
    """The linear guess with random waves added to the angles, a start for the search for other optima.

    Attributes
    ----------
    seed : int
    amplitude : float [rad]
        Size of the waves.

    Raises
    ------
    InputError
        If one of them is negative, or the seed is not a whole number.

    Examples
    --------
    >>> RandomPerturbation(seed=3).describe()
    'randomly perturbed linear guess, seed 3'
    """

    seed: int = field(validator=whole_number(0))
    amplitude: float = field(default=0.1, validator=number_within("rad", lower=0.0))

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the line and its waves, which vanish at both ends of the step."""
        waves = np.arange(1, 4)
        generator = np.random.default_rng(self.seed)
        return _add_waves(setting, time, generator.normal(0, self.amplitude / waves, (len(setting.robot.angles), 3)))

    def describe(self) -> str:
        """Return a text with the seed."""
        return f"randomly perturbed linear guess, seed {self.seed}"


@dataclass(frozen=True)
class DelayedSwing(Guess):
    """The linear guess with half a wave added to the angles: the first one, of the stance leg, leads, the others lag.

    For slow steps there may be two local optima: the swing leg waits in front of the walker, or behind it.

    Examples
    --------
    >>> DelayedSwing().describe()
    'linear guess with a delayed swing'
    """

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the line and its waves, which vanish at both ends of the step."""
        size = np.full((len(setting.robot.angles), 1), -LAG)
        size[0] = LEAD
        return _add_waves(setting, time, size)

    def describe(self) -> str:
        """Return ``"linear guess with a delayed swing"``."""
        return "linear guess with a delayed swing"


def _add_waves(setting: Setting, time: Array, size: Array) -> Sample:
    """Return the line with sine waves on each angle: columns of `size` are amplitudes of 1, 2, ... half waves [rad]."""
    line, waves = LinearGuess().sample(setting, time), np.arange(1, size.shape[1] + 1)
    phase = np.pi * waves[:, None] * time / setting.period
    angles = line.angles + size @ np.sin(phase)
    rates = line.rates + size @ (np.pi * waves[:, None] / setting.period * np.cos(phase))
    return _at_rest(setting.robot, time, angles, rates)


def _poses(setting: Setting) -> tuple[Array, Array]:
    """Return the angles after one touchdown and at the next, a step apart."""
    robot, p = setting.robot, setting.robot.vector(setting.values)
    end = touchdown_pose(robot, setting.values, setting.step_length)
    swapped = FastCall(robot.swap, p)(full_coordinates(end), np.zeros(robot.n_q))[0]
    return swapped[ANGLES], end
