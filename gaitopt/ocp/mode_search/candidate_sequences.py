"""What a homotopy proposes: closed contact sequences, and the motion their solves start from."""

import itertools
from dataclasses import dataclass, field

import numpy as np

from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.motion.solution import Solution
from gaitopt.ocp.mode_search.homotopy import HomotopyPath
from gaitopt.ocp.statement.initial_guess import Guess, Sample, Setting


@dataclass(frozen=True, eq=False)
class RelaxedSolution(Guess):
    """The motion at which a homotopy ended, as the start of a closed contact sequence.

    Attributes
    ----------
    durations_found : (n_phases,) array [s]
    time : (K,) array [s]
    found : Sample
    solution : Solution or None
        Where the phases are those of the open contact sequence.
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

    def solution_for(self, sequence: ContactSequence) -> Solution | None:
        """Return the relaxed solution."""
        return self.solution

    def describe(self) -> str:
        """Return the label."""
        return self.label


@dataclass(frozen=True, eq=False)
class Candidates:
    """Closed contact sequences that a homotopy proposes, likeliest first, and where their solves start.

    Attributes
    ----------
    trail : Trail
    sequences : tuple of ContactSequence
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

    trail: HomotopyPath
    sequences: tuple[ContactSequence, ...]
    guesses: tuple[RelaxedSolution, ...]
    agreement: float
    biactive: bool
    on_edge: int = 0


def select_admitted(sequences: list[ContactSequence], asked: ContactSequence) -> list[ContactSequence]:
    """Return those of some closed sequences that a periodic gait can have and the open sequence asked for admits."""
    found = []
    for sequence in sequences:
        try:
            found.append(sequence.check_periodic())
        except SequenceError:
            continue
    return [sequence for sequence in found if asked.admits(sequence)]


def select_simplest(asked: ContactSequence) -> ContactSequence:
    """Return a closed contact sequence that an open one admits, for when nothing better is known."""
    impact = Mode.STICK if asked.impact is Mode.ANY else asked.impact
    modes = [Mode.STICK if mode is Mode.ANY else mode for mode in asked.phases]
    if impact.slips and asked.phases[0] is Mode.ANY:
        modes.insert(0, impact)
    return ContactSequence(tuple(mode for mode, _ in itertools.groupby(modes)), impact)
