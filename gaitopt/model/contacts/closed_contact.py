"""Closed contacts as rows of numbers, and their arrangement into groups with a common tangential force."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError

REST_SPEED = 1e-12
"""Slip speeds below this value [m/s] count as rest; impacts and located events produce exact zeros."""
GAP_TOLERANCE = 1e-6
"""Largest gap [m] of a contact on the ground."""
_ROW_TOLERANCE = 1e-6
"""Largest relative difference between the tangential rows of a group."""

Friction = tuple[float, float] | Mapping[str, tuple[float, float]]
"""Coefficients (static, kinetic), of all contacts or by the name of the contact."""


@check_record
@dataclass(frozen=True, eq=False)
class ClosedContact:
    """A contact on the ground, or a joint stop at its limit, in one state of a robot.

    The gap n(q) and the slide coordinate t(q) have the velocities W_n v and W_t v and the accelerations
    W_n a + W_n' v and W_t a + W_t' v.

    Parameters
    ----------
    name : str
    normal_row : (n,) array
        W_n, gradient of the gap.
    normal_bias : float
        W_n' v [m/s^2].
    tangent_row : (n,) array, optional
        W_t, gradient of the slide coordinate; None for a joint stop.
    tangent_bias : float
        W_t' v [m/s^2].
    slip_speed : float
        W_t v [m/s].  Speeds below 1e-12 m/s count as rest.
    group : str, optional
        Name common to the contacts of one rigid body on one straight ground.  They have one tangential velocity and
        one tangential force f_t with abs(f_t) <= sum(mu f_n).
    latched : bool
        Whether a joint stop transmits forces of either sign.
    gap : float
        n(q) [m]; a contact that is not on the ground is rejected.

    Raises
    ------
    InputError
        If the gap exceeds 1e-6, or a contact with a tangential row is latched, or one without is in a group.

    Examples
    --------
    >>> import numpy as np
    >>> foot = ClosedContact("foot", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]), slip_speed=0.3)
    >>> foot.is_stop, foot.moves
    (False, True)
    """

    name: str
    normal_row: np.ndarray
    normal_bias: float = 0.0
    tangent_row: np.ndarray | None = None
    tangent_bias: float = 0.0
    slip_speed: float = 0.0
    group: str | None = None
    latched: bool = False
    gap: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.gap) <= GAP_TOLERANCE:
            raise InputError(
                f"Contact {self.name!r} is not closed: its gap must be at most {GAP_TOLERANCE:g} m, got {self.gap:g} m."
            )
        if self.tangent_row is None and self.group is not None:
            raise InputError(f"Contact {self.name!r} of group {self.group!r} has no tangential row; groups need one.")
        if self.tangent_row is not None and self.latched:
            raise InputError(
                f"Contact {self.name!r} is latched and has a tangential row; only joint stops are latched."
            )

    @property
    def is_stop(self) -> bool:
        """Whether the contact is a joint stop, without tangential direction."""
        return self.tangent_row is None

    @property
    def moves(self) -> bool:
        """Whether the contact slips."""
        return not abs(self.slip_speed) <= REST_SPEED


class ContactRows(NamedTuple):
    """Rows of closed contacts: the normal ones, then one tangential row of each group.

    Attributes
    ----------
    normals : (k, n) array
    tangents : (m, n) array
        Contacts without a group count as groups of one member.
    normal_bias : (k,) array [m/s^2]
    tangent_bias : (m,) array [m/s^2]
    members : tuple of m tuples of int
        Numbers of the contacts of each group.
    static, kinetic : (m, k) arrays
        Coefficients of friction of the members of each group, 0 elsewhere.
    """

    normals: np.ndarray
    tangents: np.ndarray
    normal_bias: np.ndarray
    tangent_bias: np.ndarray
    members: tuple[tuple[int, ...], ...]
    static: np.ndarray
    kinetic: np.ndarray


def stack_rows(contacts: Sequence[ClosedContact], friction: Friction, n: int) -> ContactRows:
    """Return the rows of closed contacts of a robot with n coordinates.

    Raises
    ------
    InputError
        If two contacts have the same name, the friction of a contact is missing or not 0 <= kinetic <= static, or the
        tangential rows of a group differ.
    """
    names = [contact.name for contact in contacts]
    if len(set(names)) < len(names):
        raise InputError(f"The names of contacts must differ, got {', '.join(names)}.")
    members = _members_of_groups(contacts)
    static, kinetic = np.zeros((len(members), len(names))), np.zeros((len(members), len(names)))
    for group, numbers in enumerate(members):
        for number in numbers:
            static[group, number], kinetic[group, number] = coefficients_of(friction, names[number])
        _require_one_row([contacts[number] for number in numbers])
    first = [contacts[numbers[0]] for numbers in members]
    return ContactRows(
        np.array([contact.normal_row for contact in contacts], dtype=float).reshape(-1, n),
        np.array([contact.tangent_row for contact in first], dtype=float).reshape(-1, n),
        np.array([contact.normal_bias for contact in contacts], dtype=float),
        np.array([contact.tangent_bias for contact in first], dtype=float),
        members,
        static,
        kinetic,
    )


def share_forces(names: Sequence[str], rows: ContactRows, forces: np.ndarray) -> dict[str, tuple[float, float]]:
    """Return the force or impulse (t, n) of each contact; that of a group is shared in proportion to mu f_n.

    Parameters
    ----------
    names : sequence of k str
    rows : ContactRows
    forces : (k + m,) array
        Normal forces, then the tangential forces of the groups.
    """
    k = len(names)
    normal, tangent = forces[:k].tolist(), [0.0] * k
    for total, members, static in zip(forces[k:].tolist(), rows.members, rows.static, strict=True):
        if len(members) == 1:
            tangent[members[0]] = total
            continue
        friction = np.ones(k) if np.isinf(static).any() or not static.any() else static
        weights = [max(friction.item(number) * normal[number], 0.0) for number in members]
        sum_of_weights = sum(weights)
        for number, weight in zip(members, weights, strict=True):
            tangent[number] = total * (weight / sum_of_weights if sum_of_weights else 1 / len(members))
    return dict(zip(names, zip(tangent, normal, strict=True), strict=True))


def _members_of_groups(contacts: Sequence[ClosedContact]) -> tuple[tuple[int, ...], ...]:
    """Return the numbers of the contacts of each group; a contact without a group has its own."""
    groups: dict[str | int, list[int]] = {}
    for number, contact in enumerate(contacts):
        if not contact.is_stop:
            groups.setdefault(number if contact.group is None else contact.group, []).append(number)
    return tuple(tuple(numbers) for numbers in groups.values())


def coefficients_of(friction: Friction, name: str) -> tuple[float, float]:
    """Return the coefficients (static, kinetic) of a contact.

    Raises
    ------
    InputError
        If they are missing or not 0 <= kinetic <= static.
    """
    if isinstance(friction, Mapping):
        if name not in friction:
            raise InputError(f"friction has no entry for contact {name!r}; it has {', '.join(friction) or 'none'}.")
        static, kinetic = friction[name]
    else:
        static, kinetic = friction
    if not 0 <= kinetic <= static:
        raise InputError(
            f"The friction of contact {name!r} must be (static, kinetic) with 0 <= kinetic <= static, "
            f"got ({static:g}, {kinetic:g})."
        )
    return static, kinetic


def _require_one_row(members: Sequence[ClosedContact]) -> None:
    """Raise an error if the contacts of a group have different tangential rows."""
    if len(members) == 1:
        return
    rows = np.array([contact.tangent_row for contact in members], dtype=float)
    difference = np.abs(rows - rows[0]).max()
    if difference > _ROW_TOLERANCE * np.abs(rows[0]).max():
        raise InputError(
            f"The tangential rows of group {members[0].group!r} ({', '.join(contact.name for contact in members)}) "
            f"differ by {difference:g}; a group consists of contacts of one rigid body on one straight ground."
        )
