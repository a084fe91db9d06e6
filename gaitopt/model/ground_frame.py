"""Positions along and across inclined ground in the coordinates of the plane, as arrays."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

RISE, INCLINE, NEXT_INCLINE = "rise", "incline", "next_incline"
"""Names of the parameters of uneven ground: the height of the next foothold, and the inclinations at both footholds."""


def place_on_plane(place: Any, parameters: Mapping[str, float], incline: str = INCLINE) -> NDArray[np.float64]:
    """Return positions along and across inclined ground as those along and across the plane [m].

    Parameters
    ----------
    place : (2,) or (2, K) array [m]
    parameters : mapping of str to float
        Parameters of the robot; without those of uneven ground the positions are already those on the plane.
    incline : str
        Name of the inclination of the ground [rad].

    Returns
    -------
    (2,) or (2, K) array

    Examples
    --------
    >>> place_on_plane([1.0, 0.0], {"rise": 0.0, "incline": 0.5}).round(4).tolist()
    [0.8776, 0.4794]
    """
    angle, place = parameters.get(incline, 0.0) if RISE in parameters else 0.0, np.asarray(place, dtype=float)
    if angle == 0:
        return place
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ place
