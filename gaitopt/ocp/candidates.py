"""What a homotopy proposes: closed words, and the motion their solves start from."""

import itertools
from dataclasses import dataclass, field

import numpy as np

from gaitopt.errors import WordError
from gaitopt.model.modes import Mode
from gaitopt.motion.motion import Array
from gaitopt.motion.solution import Solution
from gaitopt.motion.word import Word
from gaitopt.ocp.guess import Guess, Sample, Setting
from gaitopt.ocp.homotopy import Trail


@dataclass(frozen=True, eq=False)
class Relaxed(Guess):
    """The motion at which a homotopy ended, as the start of a closed word.

    Attributes
    ----------
    durations_found : (n_phases,) array [s]
    time : (K,) array [s]
    found : Sample
    solution : Solution or None
        Where the phases are those of the open word.
    label : str
    """

    durations_found: Array
    time: Array
    found: Sample
    solution: Solution | None = field(repr=False)
    label: str

    def durations(self, setting: Setting) -> Array:
        """Return the durations found."""
        return self.durations_found

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the motion found, interpolated."""

        def at(values: Array) -> Array:
            return np.array([np.interp(time, self.time, row) for row in np.atleast_2d(values)])

        found = self.found
        return Sample(at(found.angles), at(found.rates), at(found.torque), at(found.slide)[0], at(found.slide_rate)[0])

    def solution_for(self, word: Word) -> Solution | None:
        """Return the relaxed solution."""
        return self.solution

    def describe(self) -> str:
        """Return the label."""
        return self.label


@dataclass(frozen=True, eq=False)
class Candidates:
    """Closed words that a homotopy proposes, likeliest first, and where their solves start.

    Attributes
    ----------
    trail : Trail
    words : tuple of Word
        At least one.
    guesses : tuple of Relaxed
        One for each.
    agreement : float
        Largest relative difference in cost at which they agree.
    biactive : bool
        Whether both sides of a pair of the impact vanish, so that the relaxed problem does not decide its outcome.
    on_edge : int
        Intervals of an open phase that stick on the edge of the cone, where both sides of a pair vanish too.
    """

    trail: Trail
    words: tuple[Word, ...]
    guesses: tuple[Relaxed, ...]
    agreement: float
    biactive: bool
    on_edge: int = 0


def fitting(words: list[Word], asked: Word) -> list[Word]:
    """Return those of some closed words that a periodic gait can have and the open word asked for admits."""
    found = []
    for word in words:
        try:
            found.append(word.check_periodic())
        except WordError:
            continue
    return [word for word in found if asked.admits(word)]


def plainest(asked: Word) -> Word:
    """Return a closed word that an open one admits, for when nothing better is known."""
    impact = Mode.STICK if asked.impact is Mode.ANY else asked.impact
    modes = [Mode.STICK if mode is Mode.ANY else mode for mode in asked.phases]
    if impact.slips and asked.phases[0] is Mode.ANY:
        modes.insert(0, impact)
    return Word(tuple(mode for mode, _ in itertools.groupby(modes)), impact)
