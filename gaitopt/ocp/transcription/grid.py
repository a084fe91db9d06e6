"""The time grid of a contact sequence: the nodes of each phase."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Place, StepPart


@dataclass(frozen=True, eq=False, kw_only=True)
class Phase:
    """A phase of the step on the grid.

    Attributes
    ----------
    number : int
        Number of the phase, from 0.
    mode : Mode
    first, count : int
        First node and number of intervals.
    fractions : (count + 1,) array
        Instants of the nodes as fractions of the duration of the phase, from 0 to 1.
    previous : Mode
        Mode of the phase before, or for the first phase the outcome of the impact.
    following : Mode or None
        Mode of the phase after; None for the last phase.
    starts_at_rest : bool
        Whether a sliding foot has zero speed at the phase's first node.
    starts_open : bool
        Whether an open impact precedes the phase, so that the speed of a sliding foot at its first node is free.
    """

    number: int
    mode: Mode
    first: int
    count: int
    fractions: Array
    previous: Mode
    following: Mode | None
    starts_at_rest: bool
    starts_open: bool = False

    @property
    def slides(self) -> bool:
        """Whether the foot may move."""
        return self.mode.slips or self.mode is Mode.ANY

    @property
    def nodes(self) -> range:
        """Nodes of the phase, both ends included."""
        return range(self.first, self.first + self.count + 1)

    @property
    def shares(self) -> Array:
        """Shares of the intervals in the duration of the phase, shape (count,)."""
        return np.diff(self.fractions)

    def place(self, node: int | None = None, *, between: bool = False) -> Place:
        """Return the key of the phase, of one of its nodes counted from its start, or of the interval after a node."""
        return Place(StepPart.PHASE, self.number, self.mode, node, between)


def node_places(phases: Sequence[Phase]) -> list[Place]:
    """Return the key of each node of the step; a node between two phases belongs to the earlier one."""
    return [phases[0].place(0), *(phase.place(k) for phase in phases for k in range(1, phase.count + 1))]


def divide_into_phases(sequence: ContactSequence, counts: Sequence[int]) -> tuple[Phase, ...]:
    """Return the phases of a contact sequence on a grid with `counts` equal intervals each."""
    phases, first = [], 0
    for i, (mode, count) in enumerate(zip(sequence.phases, counts, strict=True)):
        before = sequence.phases[i - 1] if i > 0 else sequence.impact
        following = sequence.phases[i + 1] if i + 1 < len(sequence.phases) else None
        starts_open = i == 0 and sequence.impact is Mode.ANY
        phases.append(
            Phase(
                number=i,
                mode=mode,
                first=first,
                count=count,
                fractions=np.linspace(0.0, 1.0, count + 1),
                previous=before,
                following=following,
                starts_at_rest=mode.slips and (i > 0 or not before.slips) and not starts_open,
                starts_open=starts_open,
            )
        )
        first += count
    return tuple(phases)


def place_nodes(phases: Sequence[Phase], fractions: Sequence[Sequence[float]] | None) -> tuple[Phase, ...]:
    """Return phases with their nodes at some fractions of each duration; equally spaced without them."""
    if fractions is None:
        return tuple(phases)
    return tuple(replace(phase, fractions=np.array(at)) for phase, at in zip(phases, fractions, strict=True))
