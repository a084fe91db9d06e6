"""Test whether the accelerations of sliding contacts are determined: Painleve's paradox and jams."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import ClosedContact, Friction, stack_rows
from gaitopt.model.contacts.contact_motions import respond
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_enumeration import DEPENDENT


@check_arguments
def is_well_posed(
    mass_matrix: np.ndarray,
    contacts: Sequence[ClosedContact],
    friction: Friction,
    modes: Mapping[str, Mode],
    margin: float = 0.0,
) -> bool:
    """Return whether the contact forces are determined for all forces on a robot in given contact modes.

    With the rows A of the constraints and the directions B of the forces (W_n - s mu W_t for a contact that slips in
    direction s), A M^-1 B' has a positive determinant for every set of the contacts, each with all its rows; for
    sliding contacts it is a P-matrix.  Otherwise there is Painleve's paradox (one contact) or a jam (several).  Sets
    with linearly dependent rows are left out: their independent subsets determine the motion.

    Parameters
    ----------
    mass_matrix : (n, n) array
    contacts : sequence of ClosedContact
    friction : (static, kinetic), or mapping of contact to (static, kinetic)
    modes : mapping of contact to Mode
    margin : float
        Smallest determinant relative to that without friction.  The forces grow beyond all bounds where it vanishes;
        with a positive margin a simulation ends before.

    Raises
    ------
    InputError
        If a contact has no mode, or contacts, friction or mass matrix are invalid.

    Examples
    --------
    A uniform rod of half-length 1 that slides on its lower end, at tan(angle) = 2, is well posed for mu < 4/3:

    >>> import numpy as np
    >>> from gaitopt.model import ClosedContact, Mode, is_well_posed
    >>> c, s = 1 / np.sqrt(5), 2 / np.sqrt(5)
    >>> tip = ClosedContact("tip", np.array([0, 1, c]), tangent_row=np.array([1, 0, -s]))
    >>> rod = np.diag([1, 1, 1 / 3])
    >>> [is_well_posed(rod, [tip], (mu, mu), {"tip": Mode.SLIP_BACKWARD}) for mu in (1.33, 1.34)]
    [True, False]
    """
    rows = stack_rows(contacts, friction, len(mass_matrix))
    missing = [contact.name for contact in contacts if contact.name not in modes]
    if missing:
        raise InputError(f"modes has no entry for contact {', '.join(map(repr, missing))}.")
    response = respond(mass_matrix, np.concatenate((rows.normals, rows.tangents)), velocity=np.zeros(len(mass_matrix)))
    k = len(contacts)
    directions, sticking = np.eye(k + len(rows.members)), {}
    for group, members in enumerate(rows.members, k):
        for number in members:
            mode = modes[contacts[number].name]
            directions[group, number] = -mode.sign * rows.kinetic[group - k, number] if mode.slips else 0.0
            if mode is Mode.STICK:
                sticking[number] = group
    scale = 1 / np.sqrt(response.mobility.diagonal())
    gram = scale[:, None] * response.mobility * scale
    mobility = scale[:, None] * (response.mobility @ directions) * scale
    closed = [number for number, contact in enumerate(contacts) if modes[contact.name] is not Mode.FREE]
    for count in range(1, len(closed) + 1):
        for chosen in itertools.combinations(closed, count):
            entries = [*chosen, *sorted({sticking[number] for number in chosen if number in sticking})]
            frictionless = _determinant(gram, entries)
            if not _determinant(mobility, entries) > margin * frictionless and frictionless > DEPENDENT:
                return False
    return True


def _determinant(matrix: np.ndarray, entries: list[int]) -> float:
    """Return the principal minor of some entries."""
    if len(entries) == 1:
        return float(matrix.item(entries[0], entries[0]))
    if len(entries) == 2:
        i, j = entries
        return float(matrix.item(i, i) * matrix.item(j, j) - matrix.item(i, j) * matrix.item(j, i))
    return float(np.linalg.det(matrix[np.ix_(entries, entries)]))
