"""The time grid of a robot with several contacts: phases, their contact states and their nodes."""

from collections.abc import Sequence
from dataclasses import dataclass

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import PhaseSystem, make_phase_system
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.nlp.keys import Place, StepPart


@dataclass(frozen=True, eq=False, kw_only=True)
class GridPhase:
    """A phase on the grid, and the event at its end.

    Attributes
    ----------
    number : int
        From 0.
    state, after : tuple of Mode
        Modes of all contacts in the phase, and after its event in the names of this phase.
    from_rest : frozenset of int
        Contacts whose slip begins with the phase at rest.
    outcome : tuple of Mode or None
        Modes in the impact that ends the phase; a contact without impulse is free.  None for an event without impulse.
    is_last : bool
    first, count : int
        Number of the first node of the step, and of intervals.
    system : PhaseSystem
        Equations of motion.
    label : str
        The closed contacts and their modes.
    """

    number: int
    state: tuple[Mode, ...]
    after: tuple[Mode, ...]
    outcome: tuple[Mode, ...] | None
    from_rest: frozenset[int]
    is_last: bool
    first: int
    count: int
    system: PhaseSystem
    label: str

    @property
    def nodes(self) -> range:
        """Nodes of the phase in the step, both ends included."""
        return range(self.first, self.first + self.count + 1)

    def place(self, node: int | None = None, *, between: bool = False) -> Place:
        """Return the key of the phase, of one of its nodes counted from its start, or of the interval after a node."""
        return Place(StepPart.PHASE, self.number, None, node, between, self.label)

    def closing(self) -> list[int]:
        """Return the contacts that close at the end of the phase."""
        following = self.after if self.outcome is None else self.outcome
        return [i for i, mode in enumerate(self.state) if mode is Mode.FREE and following[i] is not Mode.FREE]

    def comes_to_rest(self, contact: int) -> bool:
        """Return whether the slip of a contact ends at rest with the phase."""
        following = self.after[contact]
        return self.outcome is None and following is not Mode.FREE and following is not self.state[contact]

    def opening(self) -> list[int]:
        """Return the contacts whose normal force vanishes at the end of the phase; none at an impact."""
        if self.outcome is not None:
            return []
        held = (Mode.FREE, Mode.LATCHED)
        return [i for i, mode in enumerate(self.state) if mode not in held and self.after[i] is Mode.FREE]


def divide_phases(
    robot: PlanarRobot, sequence: PhaseSequence, counts: Sequence[int], *, infinite: bool
) -> tuple[GridPhase, ...]:
    """Return the phases of a sequence on a grid with `counts` intervals each.

    Parameters
    ----------
    robot : PlanarRobot
    sequence : PhaseSequence
    counts : sequence of int
    infinite : bool
        Whether friction is infinite.
    """
    phases, first = [], 0
    for number, (state, count) in enumerate(zip(sequence.states(robot), counts, strict=True)):
        impact = sequence.events[number].impact
        closed = [f"{name} {mode.value}" for name, mode in state.modes if mode is not Mode.FREE]
        phases.append(
            GridPhase(
                number=number,
                state=_modes(state),
                after=_modes(sequence.state_after(robot, number)),
                outcome=_modes(sequence.outcome(robot, number)) if impact else None,
                from_rest=_slips_from_rest(robot, sequence, number),
                is_last=number + 1 == len(counts),
                first=first,
                count=count,
                system=make_phase_system(robot, state, infinite),
                label=", ".join(closed) or "flight",
            )
        )
        first += count
    return tuple(phases)


def _slips_from_rest(robot: PlanarRobot, sequence: PhaseSequence, number: int) -> frozenset[int]:
    """Return the contacts whose slip begins with a phase, neither continued nor caused by an impact."""
    before = (number - 1) % len(sequence.phases)
    event = sequence.events[before]
    entering = _modes(sequence.outcome(robot, before) if event.impact else sequence.states(robot)[before])
    if number == 0 and robot.mirror is not None:
        entering = tuple(entering[robot.mirror.contacts.index(i)] for i in range(len(entering)))
    modes = _modes(sequence.states(robot)[number])
    return frozenset(
        i for i, mode in enumerate(modes) if mode.slips and entering[i] is not mode and entering[i] is not Mode.FREE
    )


def _modes(state: ContactState) -> tuple[Mode, ...]:
    return tuple(mode for _, mode in state.modes)
