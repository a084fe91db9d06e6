"""Transcription methods: grid, integration scheme and required accuracy."""

from abc import ABC, abstractmethod

from attrs import evolve, field, frozen

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.transcription.scheme import Scheme
from gaitopt.parameters import Parameter, positive

MOST_INTERVALS = 2000
"""Largest number of intervals of a phase."""

COARSEST, COARSE = 10, 20
"""Intervals of the longest phase on the coarsest grid, and the largest number that needs no coarser grid."""


@frozen(kw_only=True)
class Method(ABC):
    """Base of the transcription methods, an attrs class; a custom method is another attrs class derived from it.

    Attributes
    ----------
    intervals : int or tuple of int
        Number of intervals of each phase.  A single number is that of a sticking phase; slip phases of the same
        sequence are short and have a quarter of it.
    tolerance : float
        Largest error of the states between nodes, computed by integration of the plan with smaller steps, and largest
        relative error of its energy balance.  If it is exceeded, :func:`gaitopt.solve` refines the method (`refine`),
        warm-started from the solution; if the plan violates its contact modes between the nodes, the intervals are
        doubled.  If infinite, the plan is not refined.
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
        """Integration scheme of one interval."""

    @abstractmethod
    def refine(self) -> "Method | None":
        """Return a more accurate version of the method, or None at the end of the refinement."""

    def list_grids(self, sequence: ContactSequence) -> "list[Method]":
        """Return the grids solved in turn, from the coarsest to the method itself.

        Coarse grids have fewer local optima and fast iterations; their solutions warm-start the next grid.
        """
        grids: list[Method] = [self]
        if max(self.intervals_for(sequence)) > COARSE:
            while (coarser := grids[0].coarsen(sequence, 4)) is not None:
                grids.insert(0, coarser)
        return grids

    def coarsen(self, sequence: ContactSequence, most: int) -> "Method | None":
        """Return the method on a grid coarser by a factor of at most `most`, or None for the coarsest."""
        counts = self.intervals_for(sequence)
        if max(counts) <= COARSEST:
            return None
        factor = min(most, max(counts) / COARSEST)
        return evolve(self, intervals=tuple(max(5, round(count / factor)) for count in counts))

    def double_intervals(self, sequence: ContactSequence) -> "Method | None":
        """Return the method with twice the intervals in every phase, or None if they exceed `MOST_INTERVALS`."""
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
