"""Seeded starts: steps that swing through a pose drawn at random."""

from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.guess import Guess, Keyframes, Line, Sample, Setting, typical_durations


@dataclass(frozen=True)
class Swing(Guess):
    """Angles from the pose after one touchdown to the pose at the next through a pose off the straight line.

    Attributes
    ----------
    seed : int
        Equal seeds give equal poses; robots of any number of angles are served.

    Examples
    --------
    >>> Swing(3).describe()
    'swing 3'
    """

    seed: int

    def durations(self, setting: Setting) -> Array:
        """Return typical durations."""
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the swing, monotone before and after its middle pose."""
        rng = np.random.default_rng(self.seed)
        ends = Line().sample(setting, np.array([0.0, setting.period])).angles
        fraction, span = rng.uniform(0.3, 0.7), np.max(np.abs(ends[:, 1] - ends[:, 0]))
        middle = ends[:, 0] + fraction * (ends[:, 1] - ends[:, 0]) + rng.uniform(-0.5, 1.0, len(ends)) * span
        frames = np.column_stack([ends[:, 0], middle, ends[:, 1]])
        angles = dict(zip(setting.robot.angles, frames.tolist(), strict=True))
        return Keyframes((0.0, fraction, 1.0), angles).sample(setting, time)

    def describe(self) -> str:
        """Return the seed in words."""
        return f"swing {self.seed}"
