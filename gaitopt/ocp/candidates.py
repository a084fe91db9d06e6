"""What a homotopy proposes: closed words, and the motion their solves start from."""

from dataclasses import dataclass, field

import numpy as np

from gaitopt.errors import WordError
from gaitopt.motion.motion import Array
from gaitopt.motion.solution import Solution
from gaitopt.motion.word import Word
from gaitopt.ocp.guess import Guess, Sample, Setting
from gaitopt.ocp.homotopy import Trail
from gaitopt.ocp.method import Method


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
    method : Method
        The grid on which the words are compared with the relaxed problem.
    agreement : float
        Largest relative difference in cost at which they agree.
    biactive : bool
        Whether both sides of a pair vanish, so that the relaxed problem does not decide the word.
    """

    trail: Trail
    words: tuple[Word, ...]
    guesses: tuple[Relaxed, ...]
    method: Method
    agreement: float
    biactive: bool


def fitting(words: list[Word]) -> list[Word]:
    """Return those of some words that a periodic gait can have."""
    found = []
    for word in words:
        try:
            found.append(word.check_periodic())
        except WordError:
            continue
    return found
