"""Choice of the contact modes of a robot in a state: free, stick or slip at each of its closed contacts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import (
    ClosedContact,
    ContactRows,
    Friction,
    share_forces,
    stack_rows,
)
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_enumeration import ConsistentMotion, ContactSpace, enumerate_modes
from gaitopt.model.contacts.mode_table import AT_REST, INSEPARABLE, GroupOptions, ModeTable, tabulate_modes


class Determinacy(Enum):
    """Number of motions that are consistent with unilateral contact and Coulomb friction.

    Examples
    --------
    >>> Determinacy.INCONSISTENT.value
    'inconsistent'
    """

    UNIQUE = "unique"
    AMBIGUOUS = "ambiguous"
    INCONSISTENT = "inconsistent"

    @staticmethod
    def of(count: int) -> "Determinacy":
        """Return the determinacy of a number of motions."""
        return (Determinacy.INCONSISTENT, Determinacy.UNIQUE)[count] if count < 2 else Determinacy.AMBIGUOUS


@dataclass(frozen=True, eq=False)
class ModeCandidate:
    """A consistent motion.

    Attributes
    ----------
    modes : mapping of contact to Mode
    acceleration : (n,) array
    forces : mapping of contact to (f_t, f_n) [N]
        The tangential force of a group is shared in proportion to mu f_n.
    tied : tuple of mappings of contact to Mode
        All consistent modes with this motion, `modes` included; more than one at the boundary of two modes.
    """

    modes: Mapping[str, Mode]
    acceleration: np.ndarray
    forces: Mapping[str, tuple[float, float]]
    tied: tuple[Mapping[str, Mode], ...]


@dataclass(frozen=True, eq=False)
class ModeChoice:
    """The contact modes of a state.

    Attributes
    ----------
    status : Determinacy
        Whether no motion, one or several are consistent.
    candidates : tuple of ModeCandidate
        The consistent motions; the first one is chosen.

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt.model import ClosedContact, select_modes
    >>> foot = ClosedContact("foot", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]))
    >>> choice = select_modes(np.eye(2), np.array([3.0, 10.0]), [foot], (0.5, 0.5))
    >>> choice.status.value, choice.chosen["foot"].value, choice.forces["foot"]
    ('unique', 'stick', (3.0, 10.0))
    """

    status: Determinacy
    candidates: tuple[ModeCandidate, ...]

    @property
    def chosen(self) -> Mapping[str, Mode]:
        """Mode of each contact."""
        return self._first.modes

    @property
    def acceleration(self) -> np.ndarray:
        """Acceleration, shape (n,)."""
        return self._first.acceleration

    @property
    def forces(self) -> Mapping[str, tuple[float, float]]:
        """Force (f_t, f_n) [N] of each contact."""
        return self._first.forces

    @property
    def _first(self) -> ModeCandidate:
        if not self.candidates:
            raise InputError("The state is inconsistent: no contact modes satisfy the friction law; check the status.")
        return self.candidates[0]


def select_modes(
    mass_matrix: np.ndarray,
    force: np.ndarray,
    contacts: Sequence[ClosedContact],
    friction: Friction,
    ended: Mapping[str, Mode] = MappingProxyType({}),
) -> ModeChoice:
    """Choose the modes of all closed contacts by enumeration.

    With the equations of motion M a + h - E u = sum(W' f), a moving contact slips in its direction or leaves; a contact
    at rest sticks, slips in either direction or leaves.  The combinations with f_n >= 0 and a_n >= 0, forces in the
    cone (static at rest) and directions of fresh slips equal to the accelerations are kept.  Those with the same
    acceleration are one motion.

    If the contact rows are linearly dependent, the forces of a combination are those of the least sum of f_i^2 G_ii, G
    the mobility W M^-1 W'.  If static friction exceeds kinetic friction, a contact that may stick does not slip.

    Parameters
    ----------
    mass_matrix : (n, n) array
    force : (n,) array
        h - E u.
    contacts : sequence of ClosedContact
        Up to about five: their number of combinations is 4^k.
    friction : (static, kinetic), or mapping of contact to (static, kinetic)
    ended : mapping of contact to Mode, optional
        Modes that have just ended at an event; they are chosen again only if nothing else is consistent.
        ``Mode.CLOSED`` stands for every closed mode: the contact lifts off.

    Returns
    -------
    ModeChoice

    Raises
    ------
    InputError
        If a contact with infinite kinetic friction moves, or contacts, friction or mass matrix are invalid.

    Examples
    --------
    A box (half-width 0.1, half-height 0.3) on a slope of 0.36 rad tips if friction is large enough:

    >>> import numpy as np
    >>> from gaitopt.model import ClosedContact, select_modes
    >>> b, h = 0.1, 0.3
    >>> rows = {name: (np.array([0, 1, x]), np.array([1, 0, h])) for name, x in (("rear", -b), ("front", b))}
    >>> corners = [ClosedContact(name, n, tangent_row=t, group="box") for name, (n, t) in rows.items()]
    >>> mass, weight = np.diag([1, 1, (b**2 + h**2) / 3]), 9.81 * np.array([-np.sin(0.36), np.cos(0.36), 0])
    >>> for mu in (0.5, 0.3):
    ...     print({name: mode.value for name, mode in select_modes(mass, weight, corners, (mu, mu)).chosen.items()})
    {'rear': 'free', 'front': 'stick'}
    {'rear': 'slip+', 'front': 'slip+'}
    """
    rows = stack_rows(contacts, friction, len(force))
    space = ContactSpace(mass_matrix, rows, -np.asarray(force, dtype=float))
    signs = _slip_signs(contacts, rows)
    table = tabulate_modes(tabulate_options(rows, signs), stops_of(contacts))
    constant = space.matrix @ space.free + np.concatenate((rows.normal_bias, rows.tangent_bias))
    problem = space.state_problem(rows, constant, np.array([sign == 0 for sign in signs], dtype=bool))
    motions = enumerate_modes(problem, table)
    names = [contact.name for contact in contacts]
    if ended:
        motions = _prefer_changes(motions, table, [ended.get(name) for name in names])
    if len(motions) > 1:
        motions = _prefer_sticking(motions, table, rows, problem.fresh)
    candidates = []
    for motion in motions:
        forces = space.scale * motion.forces[0]
        tied = tuple(dict(zip(names, table.modes[number], strict=True)) for number in motion.numbers)
        acceleration = space.free + space.per_force @ forces
        candidates.append(ModeCandidate(tied[0], acceleration, share_forces(names, rows, forces), tied))
    return ModeChoice(Determinacy.of(len(candidates)), tuple(candidates))


def _slip_signs(contacts: Sequence[ClosedContact], rows: ContactRows) -> list[int]:
    """Return the direction of slip of each group, 0 at rest.

    Raises
    ------
    InputError
        If the members of a group move in different directions, or a group with infinite friction moves.
    """
    signs = []
    for members, kinetic in zip(rows.members, rows.kinetic, strict=True):
        of_group = {1 if contacts[i].slip_speed > 0 else -1 for i in members if contacts[i].moves}
        described = ", ".join(f"{contacts[i].name!r}: {contacts[i].slip_speed:g}" for i in members)
        if len(of_group) > 1:
            raise InputError(f"The contacts of a group must slip in the same direction, got {described} [m/s].")
        if of_group and np.isinf(kinetic).any():
            raise InputError(f"Contacts with infinite friction must have slip speeds of 0, got {described} [m/s].")
        signs.append(sum(of_group))
    return signs


def tabulate_options(rows: ContactRows, signs: Sequence[int]) -> tuple[GroupOptions, ...]:
    """Return the options of each group from its direction of slip, 0 at rest."""
    infinite = np.isinf(rows.kinetic).any(axis=1).tolist()
    return tuple(
        GroupOptions(members, (sign,) if sign else INSEPARABLE if rough else AT_REST)
        for members, sign, rough in zip(rows.members, signs, infinite, strict=True)
    )


def stops_of(contacts: Sequence[ClosedContact]) -> tuple[tuple[int, bool], ...]:
    """Return the numbers of the joint stops, and whether each is latched."""
    return tuple((number, contact.latched) for number, contact in enumerate(contacts) if contact.is_stop)


def _prefer_sticking(
    motions: list[ConsistentMotion], table: ModeTable, rows: ContactRows, fresh: np.ndarray
) -> list[ConsistentMotion]:
    """Return the motions without those in which a contact slips that may stick by its higher static friction."""
    reluctant = {
        number
        for members, rests, static, kinetic in zip(rows.members, fresh, rows.static, rows.kinetic, strict=True)
        if rests
        for number in members
        if static[number] > kinetic[number]
    }

    def sticks_instead(modes: tuple[Mode, ...], others: tuple[Mode, ...]) -> bool:
        changes = [(i, a, b) for i, (a, b) in enumerate(zip(modes, others, strict=True)) if a is not b]
        return bool(changes) and all(i in reluctant and a.slips and b is Mode.STICK for i, a, b in changes)

    combinations = [table.modes[number] for motion in motions for number in motion.numbers]
    return [
        motion
        for motion in motions
        if not any(sticks_instead(table.modes[motion.numbers[0]], others) for others in combinations)
    ]


def _prefer_changes(
    motions: list[ConsistentMotion], table: ModeTable, ended: Sequence[Mode | None]
) -> list[ConsistentMotion]:
    """Return the motions without modes that have just ended, if there are such motions."""
    refused = [
        any(
            mode is end or (end is Mode.CLOSED and mode is not Mode.FREE)
            for mode, end in zip(modes, ended, strict=True)
        )
        for modes in table.modes
    ]
    motions = [motion.represent_without(refused) for motion in motions]
    return [motion for motion in motions if not refused[motion.numbers[0]]] or motions
