"""Transcription methods: a grid, how it is integrated, and how accurate the result must be."""

from abc import ABC, abstractmethod

from attrs import evolve, field, frozen

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.transcription.scheme import Scheme
from gaitopt.parameters import Parameter, positive

MOST_INTERVALS = 2000
COARSEST, COARSE = 10, 20
"""Intervals of the longest phase: on the grid to begin with, and up to which a grid is solved on at once."""


@frozen(kw_only=True)
class Method(ABC):
    """Base of the transcription methods, an attrs class; derive another attrs class from it to add a method.

    Attributes
    ----------
    intervals : int or tuple of int
        Intervals of each phase.  A single number is meant for a sticking phase; slip phases beside one are short
        and get a quarter of it.
    tolerance : float
        Largest error of the states between nodes, found by integrating the plan again with smaller steps, and largest
        relative closing error of its energy ledger.  Where it is exceeded, :func:`gaitopt.solve` takes the method's
        `finer` version and goes on from the solution; where the plan leaves its contact modes between the points at
        which they are held, it doubles the intervals.  Infinite: the plan is left as the grid gives it.
    """

    intervals: int | tuple[int, ...] = 40
    tolerance: float = field(default=1e-7, validator=positive(infinite=True))

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the method with its options, for the record of the problem."""

    @property
    @abstractmethod
    def scheme(self) -> Scheme:
        """How one interval is integrated."""

    @abstractmethod
    def finer(self) -> "Method | None":
        """Return a more accurate version of the method, or None where refinement ends."""

    def approach(self, sequence: ContactSequence) -> "list[Method]":
        """Return the grids to solve on in turn, the last being the method itself.

        A coarse grid has a smoother landscape and is quick; from its solution the next one needs few iterations.
        """
        path: list[Method] = [self]
        if max(self.intervals_for(sequence)) > COARSE:
            while (coarser := path[0].coarser(sequence, 4)) is not None:
                path.insert(0, coarser)
        return path

    def coarser(self, sequence: ContactSequence, most: int) -> "Method | None":
        """Return the method on a grid coarser by a factor of at most `most`, or None where it is coarse already."""
        counts = self.intervals_for(sequence)
        if max(counts) <= COARSEST:
            return None
        factor = min(most, max(counts) / COARSEST)
        return evolve(self, intervals=tuple(max(5, round(count / factor)) for count in counts))

    def doubled(self, sequence: ContactSequence) -> "Method | None":
        """Return the method with twice the intervals in every phase, or None where that is beyond all measure."""
        counts = tuple(2 * count for count in self.intervals_for(sequence))
        return None if max(counts) > MOST_INTERVALS else evolve(self, intervals=counts)

    def intervals_for(self, sequence: ContactSequence) -> tuple[int, ...]:
        """Return the number of intervals of each phase.

        Raises
        ------
        InputError
            If a count is not a whole number of at least 2, or there is not one per phase.
        """
        if isinstance(self.intervals, tuple | list):
            counts = tuple(self.intervals)
        else:
            check_count("intervals", self.intervals, 2, MOST_INTERVALS)
            short = max(5, int(self.intervals) // 4) if Mode.STICK in sequence.phases else self.intervals
            counts = tuple(short if mode.slips else self.intervals for mode in sequence.phases)
        if len(counts) != len(sequence.phases):
            raise InputError(
                f"intervals has {len(counts)} entries, but the sequence '{sequence}' has {len(sequence.phases)} phases."
            )
        for count in counts:
            check_count("intervals", count, 2, MOST_INTERVALS)
        return tuple(int(count) for count in counts)


def check_count(name: str, count: object, lower: int, upper: int) -> None:
    """Raise InputError unless `count` is a whole number within bounds."""
    if isinstance(count, bool):
        raise InputError(f"{name} must be a whole number, got {count!r}.")
    Parameter(name, lower, "1", "", lower=lower, upper=upper, whole=True).check(count)
