"""Ratio of tangential to normal contact force over time, for figures."""

import numpy as np

from gaitopt.motion.motion import Array

NEGLIGIBLE = 1e-6
"""Normal force relative to its largest value below which the ratio shows rounding errors only, as at a lift-off."""


def find_force_ratio(force: Array, largest: float) -> Array:
    """Return f_t / f_n, shape (K,); nan where the normal force is negative or negligible.

    Parameters
    ----------
    force : (2, K) array
        Tangential and normal contact force [N].
    largest : float
        Largest normal force of the motion [N].

    Examples
    --------
    >>> import numpy as np
    >>> find_force_ratio(np.array([[1.0, -5e-12, 0.0], [4.0, 2e-13, -1.0]]), 4.0)
    array([0.25,  nan,  nan])
    """
    f_t, f_n = force
    loaded = f_n > NEGLIGIBLE * max(largest, 0.0)
    return np.where(loaded, f_t / np.where(loaded, f_n, 1.0), np.nan)
