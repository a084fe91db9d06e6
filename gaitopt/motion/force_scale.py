"""Scale of the forces in animations."""

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView

WEIGHT_DRAWN, LONGEST_FORCE = 0.45, 0.9
"""Length of a force as large as the weight, and of the largest force at most, in heights of the walker."""


LEAST_HEIGHT = 1e-3
"""Height of all drawn points [m] below which a motion is drawn to the scale of its horizontal extent."""


def drawn_height(drawn: Array) -> float:
    """Return the height to whose scale a walker is drawn [m]: that of its highest point in the motion.

    A robot of which only points on the ground are drawn is as high as its points are wide, but at least 1 m.

    Parameters
    ----------
    drawn : (2, n) array [m]
        All drawn points of a motion.

    Examples
    --------
    >>> drawn_height(np.array([[0.0, 0.3], [0.0, 0.9]])), drawn_height(np.array([[0.0, 3.0], [0.0, 0.0]]))
    (0.9, 3.0)
    """
    height = float(np.max(drawn[1]))
    return height if height > LEAST_HEIGHT else max(float(np.ptp(drawn[0])), 1.0)


def force_scale(view: MotionView) -> float:
    """Return the length of a force of 1 N over the height of the walker [1/N]; large forces are drawn shorter.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.motion.view_motion import view_motion
    >>> view = view_motion(load("docs/examples/compass_slip.h5").motion)
    >>> round(force_scale(view) * view.weight, 9)
    0.45
    """
    largest = max(float(np.max(part.forces[list(view.loaded), 1], initial=0.0)) for part in view.segments)
    return min(WEIGHT_DRAWN / view.weight, LONGEST_FORCE / max(largest, 1e-9))
