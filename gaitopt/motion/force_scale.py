"""Scale of the forces in animations."""

import numpy as np

from gaitopt.motion.motion_view import MotionView

WEIGHT_DRAWN, LONGEST_FORCE = 0.45, 0.9
"""Length of a force as large as the weight, and of the largest force at most, in heights of the walker."""


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
