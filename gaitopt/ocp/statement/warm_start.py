"""Warm starts: initial guesses from a motion, or from a gait with its multipliers."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES, SLIDE
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.statement.initial_guess import Guess, Sample, Setting, typical_durations


@check_record
@dataclass(frozen=True, eq=False)
class FromMotion(Guess):
    """The first step of an earlier motion, scaled in time and divided into the phases of the contact sequence.

    Attributes
    ----------
    motion : Motion
    label : str
        Origin of the motion, for the record.

    Examples
    --------
    >>> from gaitopt import load
    >>> FromMotion(load("docs/examples/compass_slip.h5").motion, label="the gait of the README").describe()
    'the gait of the README'
    """

    motion: Motion = field(repr=False)
    label: str = "a previous motion"

    def __post_init__(self) -> None:
        if not isinstance(self.motion, Motion):
            hint = " Use WarmStart(gait) to start from a gait." if isinstance(self.motion, Gait) else ""
            raise InputError(f"FromMotion needs a Motion, got {type(self.motion).__name__}.{hint}")

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters of the motion (SI units)."""
        return self.motion.parameters

    def durations(self, setting: Setting) -> Array:
        """Return the durations of the motion if its contact sequence has the same phases, otherwise typical ones."""
        segments = self._segments()
        if tuple(s.mode for s in segments) == setting.sequence.phases:
            durations = np.array([s.duration for s in segments])
            return durations * setting.period / durations.sum()
        return typical_durations(setting)

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the motion at the same fractions of its period."""
        if self.motion.angles != setting.robot.angles:
            raise InputError(
                f"The guess must be a motion of the angles {setting.robot.angles}, got {self.motion.angles}."
            )
        segments = self._segments()
        clock = np.concatenate([s.time for s in segments]) - segments[0].time[0]
        clock, unique = np.unique(clock, return_index=True)
        at = time * clock[-1] / setting.period

        def channel(name: str) -> Array:
            values = np.concatenate([getattr(s, name) for s in segments], axis=-1)[..., unique]
            return np.array([np.interp(at, clock, row) for row in values]).reshape(-1, time.size)

        q, v, torque = channel("q"), channel("v"), channel("torque")
        return Sample(q[ANGLES], v[ANGLES], torque, q[SLIDE] - q[SLIDE, 0], v[SLIDE])

    def describe(self) -> str:
        """Return the label."""
        return self.label

    def _segments(self) -> list:
        first = self.motion.segments[0].step
        return [segment for segment in self.motion.segments if segment.step == first]


@check_record
@dataclass(frozen=True, eq=False)
class WarmStart(Guess):
    """A solved gait, whose unknowns and multipliers warm-start the solver.

    The gait of a nearby problem needs the fewest iterations; grid, method and impact may differ.  For a sequence with
    other phases only the motion is used, as by :class:`FromMotion`: multipliers of another sequence are misleading.

    Attributes
    ----------
    gait : Gait
    label : str
        Origin of the gait, for the record.
    neighbour : ContactSequence, optional
        Contact sequence of the gait from which a study solves the problem, for the record.

    Examples
    --------
    >>> from gaitopt import load
    >>> WarmStart(load("docs/examples/compass_slip.h5")).describe()
    'a gait that was solved before'
    """

    gait: Gait = field(repr=False)
    label: str = "a gait that was solved before"
    neighbour: ContactSequence | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.gait, Gait):
            hint = " Use FromMotion(motion) to start from a motion." if isinstance(self.gait, Motion) else ""
            raise InputError(f"WarmStart needs a Gait, got {type(self.gait).__name__}.{hint}")

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters of the gait (SI units)."""
        return self.gait.motion.parameters

    def durations(self, setting: Setting) -> Array:
        """Return the durations of the gait if its contact sequence has the same phases, otherwise typical ones."""
        return FromMotion(self.gait.motion).durations(setting)

    def solution_for(self, sequence: ContactSequence) -> Solution | None:
        """Return the solution of the gait, or None for a contact sequence with other phases."""
        return self.gait.solution if self.gait.sequence.phases == sequence.phases else None

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the motion of the gait at the same fractions of its period."""
        return FromMotion(self.gait.motion).sample(setting, time)

    def describe(self) -> str:
        """Return the label."""
        return self.label
