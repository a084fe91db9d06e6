"""Candidates of a homotopy: closed contact sequences, and the initial guesses of their solves."""

import itertools
from dataclasses import field

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.mode_search.homotopy import HomotopyPath
from gaitopt.ocp.statement.initial_guess import Guess, Sample, Setting


@dataclass(frozen=True, eq=False)
class RelaxedSolution(Guess):
    """The motion at which a homotopy ended, as the initial guess for a closed contact sequence.

    Attributes
    ----------
    phase_durations : (n_phases,) array [s]
    time : (K,) array [s]
    motion : Sample
    solution : Solution or None
        Relaxed solution, if the closed sequence has the phases of the open one.
    label : str
    """

    phase_durations: Array
    time: Array
    motion: Sample
    solution: Solution | None = field(repr=False)
    label: str

    def durations(self, setting: Setting) -> Array:
        """Return the durations of the relaxed solution."""
        return self.phase_durations

    def sample(self, setting: Setting, time: Array) -> Sample:
        """Return the relaxed motion, interpolated linearly."""

        def at(values: Array) -> Array:
            return np.array([np.interp(time, self.time, row) for row in np.atleast_2d(values)])

        motion = self.motion
        slide, slide_rate = at(motion.slide)[0], at(motion.slide_rate)[0]
        return Sample(at(motion.angles), at(motion.rates), at(motion.torque), slide, slide_rate)

    def solution_for(self, sequence: ContactSequence) -> Solution | None:
        """Return the relaxed solution."""
        return self.solution

    def describe(self) -> str:
        """Return the label."""
        return self.label


@dataclass(frozen=True, eq=False)
class Candidates:
    """Closed contact sequences that a homotopy proposes, likeliest first, and the initial guesses of their solves.

    Attributes
    ----------
    path : HomotopyPath
    sequences : tuple of ContactSequence
        At least one.
    guesses : tuple of RelaxedSolution
        One per sequence.
    agreement : float
        Largest accepted relative difference between the relaxed and the closed cost.
    biactive : bool
        Whether both sides of a pair of the impact vanish, so that the relaxed problem leaves its outcome undecided.
    on_edge : int
        Number of intervals of open phases that stick on the edge of the cone, where both sides of a pair vanish.
    """

    path: HomotopyPath
    sequences: tuple[ContactSequence, ...]
    guesses: tuple[RelaxedSolution, ...]
    agreement: float
    biactive: bool
    on_edge: int = 0


def select_admitted(sequences: list[ContactSequence], open_sequence: ContactSequence) -> list[ContactSequence]:
    """Return the closed sequences that are periodic and that the open sequence admits."""
    periodic = []
    for sequence in sequences:
        try:
            periodic.append(sequence.check_periodic())
        except SequenceError:
            continue
    return [sequence for sequence in periodic if open_sequence.admits(sequence)]


def select_simplest(open_sequence: ContactSequence) -> ContactSequence:
    """Return the closed contact sequence with the fewest slips that an open one admits."""
    impact = Mode.STICK if open_sequence.impact is Mode.ANY else open_sequence.impact
    modes = [Mode.STICK if mode is Mode.ANY else mode for mode in open_sequence.phases]
    if impact.slips and open_sequence.phases[0] is Mode.ANY:
        modes.insert(0, impact)
    return ContactSequence(tuple(mode for mode, _ in itertools.groupby(modes)), impact)
