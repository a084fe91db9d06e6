"""Entries of the coordinates q, of the velocities v and of the state y = (q, v) of a robot.

q contains the slide coordinate and the gap of the stance contact, then the angles; v contains their rates.  Modules
outside the model index q, v and y by these names alone.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

SLIDE, GAP = 0, 1
"""Entries of the slide coordinate and of the gap."""
CONTACT, ANGLES = slice(0, 2), slice(2, None)
"""Entries of both coordinates of the contact, and of the angles."""


def angle_entry(number: int) -> int:
    """Return the entry of an angle in q, and of its rate in v, from its number among the angles.

    Examples
    --------
    >>> angle_entry(0)
    2
    """
    return CONTACT.stop + number


def count_coordinates(angles: int) -> int:
    """Return the number of coordinates of a robot with this number of angles."""
    return CONTACT.stop + angles


def full_coordinates(angles: Any, slide: Any = 0.0) -> NDArray[np.float64]:
    """Return q for angles and a contact on the ground, or v for their rates.

    Parameters
    ----------
    angles : (n_angles,) or (n_angles, K) array
        Angles [rad], or rates [rad/s].
    slide : float or (K,) array
        Slide coordinate [m], or slip velocity [m/s].

    Returns
    -------
    (n_q,) or (n_q, K) array

    Examples
    --------
    >>> full_coordinates([0.1, 0.2], 0.5).tolist()
    [0.5, 0.0, 0.1, 0.2]
    """
    angles = np.asarray(angles, dtype=float)
    coordinates = np.zeros((count_coordinates(angles.shape[0]), *angles.shape[1:]))
    coordinates[SLIDE], coordinates[ANGLES] = slide, angles
    return coordinates


class StateEntries(NamedTuple):
    """Entries of the state y = (q, v) of a robot with n_q coordinates.

    Attributes
    ----------
    n_q : int

    Examples
    --------
    >>> entries = StateEntries(4)
    >>> [*entries.angles], entries.slip_velocity, [*entries.rates]
    ([2, 3], 4, [6, 7])
    """

    n_q: int

    @property
    def angles(self) -> range:
        """Entries of the angles."""
        return range(CONTACT.stop, self.n_q)

    @property
    def slip_velocity(self) -> int:
        """Entry of the slip velocity of the contact."""
        return self.n_q + SLIDE

    @property
    def rates(self) -> range:
        """Entries of the rates of the angles."""
        return range(self.n_q + CONTACT.stop, 2 * self.n_q)

    @property
    def without_position(self) -> slice:
        """All entries except the position of the contact, which a periodic gait does not repeat."""
        return slice(CONTACT.stop, None)
