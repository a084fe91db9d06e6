"""Choice of the contact modes of a robot in a state: free, stick or slip at each of its closed contacts."""

from collections.abc import Mapping, Sequence
from enum import Enum
from types import MappingProxyType

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import ClosedContact, Friction, coefficients_of
from gaitopt.model.contacts.contact_motions import find_motions
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_enumeration import ConsistentMotion


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
            raise InputError(
                "No contact modes satisfy the friction law in this state; test the attribute status before reading the "
                "modes."
            )
        return self.candidates[0]


@check_arguments
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
    consistent = find_motions(mass_matrix, contacts, friction, force=force)
    motions = consistent.motions
    if ended:
        motions = _prefer_changes(motions, [ended.get(contact.name) for contact in contacts])
    if len(motions) > 1:
        motions = _prefer_sticking(motions, contacts, friction)
    candidates = []
    for motion in motions:
        tied = consistent.name_modes(motion)
        candidates.append(ModeCandidate(tied[0], consistent.evaluate(motion), consistent.share_forces(motion), tied))
    return ModeChoice(Determinacy.of(len(candidates)), tuple(candidates))


def _prefer_changes(motions: list[ConsistentMotion], ended: Sequence[Mode | None]) -> list[ConsistentMotion]:
    """Return the motions without modes that have just ended, if there are such motions."""

    def persists(modes: tuple[Mode, ...]) -> bool:
        pairs = zip(modes, ended, strict=True)
        return any(mode is end or (end is Mode.CLOSED and mode is not Mode.FREE) for mode, end in pairs)

    changed: list[ConsistentMotion] = []
    others: list[ConsistentMotion] = []
    for motion in motions:
        order = sorted(zip(motion.combinations, motion.forces, strict=True), key=lambda pair: persists(pair[0]))
        represented = ConsistentMotion(*map(tuple, zip(*order, strict=True)))
        (others if persists(represented.combinations[0]) else changed).append(represented)
    return changed or others


def _prefer_sticking(
    motions: list[ConsistentMotion], contacts: Sequence[ClosedContact], friction: Friction
) -> list[ConsistentMotion]:
    """Return the motions without those in which a contact slips that may stick by its higher static friction."""
    pairs = [(1.0, 1.0) if contact.is_stop else coefficients_of(friction, contact.name) for contact in contacts]
    combinations = [modes for motion in motions for modes in motion.combinations]

    def may_stick(modes: tuple[Mode, ...], others: tuple[Mode, ...]) -> bool:
        changes = [(i, a, b) for i, (a, b) in enumerate(zip(modes, others, strict=True)) if a is not b]
        return bool(changes) and all(pairs[i][0] > pairs[i][1] and a.slips and b is Mode.STICK for i, a, b in changes)

    return [
        motion for motion in motions if not any(may_stick(motion.combinations[0], others) for others in combinations)
    ]
