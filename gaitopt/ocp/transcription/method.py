"""Transcription methods: grid, integration scheme and required accuracy."""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from attrs import evolve, field, frozen

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.printable import format_count
from gaitopt.ocp.transcription.scheme import Scheme
from gaitopt.parameters import optional, positive, recall_parameter

MOST_INTERVALS = 2000
"""Largest number of intervals of a phase."""

DEFAULT_INTERVALS = 40
"""Intervals of a sticking phase on the default grid."""

COST_TOLERANCE = 0.003
"""Largest estimated relative error of the objective on the default grid."""

Fractions = tuple[tuple[float, ...], ...]
"""Instants of the nodes of each phase as fractions of its duration."""

COARSEST, COARSE = 10, 20
"""Intervals of the longest phase on the coarsest grid, and the largest number that needs no coarser grid."""


@frozen(kw_only=True)
class Method(ABC):
    """Base of the transcription methods, an attrs class; a custom method is another attrs class derived from it.

    Attributes
    ----------
    intervals : int or tuple of int, optional
        Number of intervals of each phase.  A single number is that of a sticking phase; slip phases of the same
        sequence are short and have a quarter of it.  By default the grid is chosen by `cost_tolerance`; a stated number
        is kept.
    cost_tolerance : float, optional
        Largest relative difference of the objective from its value on an infinitely fine grid, as estimated from the
        grids of the solve.  While it is exceeded, :func:`gaitopt.solve` moves the nodes to the jumps of the torques and
        adds intervals.  By default 0.003 if `intervals` is not stated, otherwise infinite: the stated grid is kept.
    fractions : tuple of tuple of float, optional
        Instants of the nodes of each phase as fractions of its duration, from 0 to 1; equal intervals by default.
    tolerance : float
        Largest error of the states between nodes, computed by integration of the plan with smaller steps, and largest
        relative error of its energy balance.  If it is exceeded, :func:`gaitopt.solve` refines the method (`refine`),
        warm-started from the solution; if the plan violates its contact modes between the nodes, the intervals are
        doubled.  If infinite, the plan is not refined.
    """

    intervals: int | tuple[int, ...] | None = None
    tolerance: float = field(default=1e-7, validator=positive(infinite=True))
    cost_tolerance: float | None = field(default=None, validator=optional(positive(infinite=True)))
    fractions: tuple[tuple[float, ...], ...] | None = None

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

    @property
    def largest_cost_error(self) -> float:
        """Largest relative difference of the objective from its value on an infinitely fine grid; inf for any."""
        if self.cost_tolerance is not None:
            return self.cost_tolerance
        return COST_TOLERANCE if self.intervals is None else math.inf

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
        return self.replace_grid(tuple(max(5, round(count / factor)) for count in counts))

    def double_intervals(self, sequence: ContactSequence) -> "Method | None":
        """Return the method with twice the intervals in every phase, or None if they exceed `MOST_INTERVALS`."""
        counts = tuple(2 * count for count in self.intervals_for(sequence))
        if max(counts) > MOST_INTERVALS:
            return None
        return self.replace_grid(counts, self.fractions and tuple(_halve(nodes) for nodes in self.fractions))

    def replace_grid(self, intervals: tuple[int, ...], fractions: Fractions | None = None) -> "Method":
        """Return the method with other numbers of intervals, equal ones without the fractions of their nodes."""
        return evolve(self, intervals=intervals, fractions=fractions, cost_tolerance=self.largest_cost_error)

    def intervals_for(self, sequence: ContactSequence) -> tuple[int, ...]:
        """Return the number of intervals of each phase.

        Raises
        ------
        InputError
            If a count is not a whole number of at least 2, or there is not one per phase.
        """
        longest = DEFAULT_INTERVALS if self.intervals is None else self.intervals
        if isinstance(longest, tuple | list):
            counts = tuple(longest)
        else:
            check_count("intervals", longest, 2, MOST_INTERVALS)
            short = max(5, int(longest) // 4) if Mode.STICK in sequence.phases else longest
            counts = tuple(short if mode.slips else longest for mode in sequence.phases)
        if len(counts) != len(sequence.phases):
            raise InputError(
                f"intervals has {format_count(len(counts), 'entry', 'entries')}, but the sequence '{sequence}' has "
                f"{format_count(len(sequence.phases), 'phase')}."
            )
        for count in counts:
            check_count("intervals", count, 2, MOST_INTERVALS)
        return tuple(int(count) for count in counts)

    def fractions_for(self, sequence: ContactSequence) -> Fractions | None:
        """Return the fractions of the phases at which their nodes are, or None for equal intervals.

        Raises
        ------
        InputError
            If they do not increase from 0 to 1 over the intervals of each phase.
        """
        if self.fractions is None:
            return None
        counts = self.intervals_for(sequence)
        if len(self.fractions) != len(counts):
            raise InputError(
                f"fractions has {format_count(len(self.fractions), 'entry', 'entries')}, but the sequence '{sequence}' "
                f"has {format_count(len(counts), 'phase')}."
            )
        for nodes, count in zip(self.fractions, counts, strict=True):
            ends = len(nodes) == count + 1 and nodes[0] == 0 and nodes[-1] == 1
            if not ends or not all(one < other for one, other in itertools.pairwise(nodes)):
                raise InputError(
                    f"fractions must increase from 0 to 1 at the {count + 1} nodes of {count} intervals, got {nodes!r}."
                )
        return self.fractions


def _halve(nodes: Sequence[float]) -> tuple[float, ...]:
    """Return nodes with the middles of their intervals."""
    return tuple(np.interp(np.arange(2 * len(nodes) - 1) / 2, np.arange(len(nodes)), nodes).tolist())


def check_count(name: str, count: object, lower: int, upper: int) -> None:
    """Raise InputError unless `count` is a whole number within bounds."""
    if isinstance(count, bool):
        raise InputError(f"{name} must be a whole number, got {count!r}.")
    recall_parameter(name, lower=lower, upper=upper, whole=True).check(count)
