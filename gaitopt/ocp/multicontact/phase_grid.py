"""The time grid of a robot with several contacts: phases, their contact states and their nodes."""

from collections.abc import Sequence

from gaitopt.dataclass import dataclass
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
    from_rest, opened, lifted, loaded : frozenset of int
        Contacts whose slip begins with the phase at rest, those that have left the ground at its beginning, among these
        those that have left it without impact, and those that have closed without impact.
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
    opened: frozenset[int]
    lifted: frozenset[int]
    loaded: frozenset[int]
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
        others = (Mode.FREE, Mode.LATCHED)
        return [i for i, mode in enumerate(self.state) if mode not in others and self.after[i] is Mode.FREE]


def opening_bodies(phase: GridPhase) -> frozenset[int]:
    """Return the first contact of each sticking body that leaves the ground at the end of a phase."""
    opening = phase.opening()
    return frozenset(members[0] for members in phase.system.sticking if all(i in opening for i in members))


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
        impact, modes = sequence.events[number].impact, _modes(state)
        before, entering = _modes_before(robot, sequence, number)
        opened = frozenset(i for i, mode in enumerate(modes) if mode is Mode.FREE and before[i] is not Mode.FREE)
        loaded = frozenset(i for i, mode in enumerate(modes) if mode is not Mode.FREE and before[i] is Mode.FREE)
        slipping = [i for i, mode in enumerate(modes) if mode.slips]
        closed = [f"{name} {mode.value}" for name, mode in state.modes if mode is not Mode.FREE]
        phases.append(
            GridPhase(
                number=number,
                state=modes,
                after=_modes(sequence.state_after(robot, number)),
                outcome=_modes(sequence.outcome(robot, number)) if impact else None,
                from_rest=frozenset(i for i in slipping if entering[i] not in (modes[i], Mode.FREE)),
                opened=opened,
                lifted=frozenset() if sequence.events[number - 1].impact else opened,
                loaded=frozenset() if sequence.events[number - 1].impact else loaded,
                is_last=number + 1 == len(counts),
                first=first,
                count=count,
                system=make_phase_system(robot, state, infinite),
                label=", ".join(closed) or "flight",
            )
        )
        first += count
    return tuple(phases)


def _modes_before(
    robot: PlanarRobot, sequence: PhaseSequence, number: int
) -> tuple[tuple[Mode, ...], tuple[Mode, ...]]:
    """Return the modes in the phase before another one and those of its impact, in the names of the other one."""
    before = (number - 1) % len(sequence.phases)
    state = sequence.states(robot)[before]
    entering = sequence.outcome(robot, before) if sequence.events[before].impact else state
    modes = _modes(state), _modes(entering)
    if number == 0 and robot.mirror is not None:
        places = [robot.mirror.contacts.index(i) for i in range(len(state.modes))]
        return tuple(modes[0][i] for i in places), tuple(modes[1][i] for i in places)
    return modes


def _modes(state: ContactState) -> tuple[Mode, ...]:
    return tuple(mode for _, mode in state.modes)
