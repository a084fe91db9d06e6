"""Starts for gaits of doubled period near a gait with a negative real multiplier."""

from collections.abc import Iterator

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.stability.cycle import Cycle

FLIP_MULTIPLIER = -0.7
"""Real multiplier below which starts are generated: near -1, because a period doubling may be subcritical."""
DISPLACEMENTS = (0.01, 0.03, 0.1, 0.3)
"""Displacements along an eigenvector relative to the natural size of the coordinates."""


def doubled_starts(cycle: Cycle, scale: Array) -> Iterator[tuple[Array, float]]:
    """Yield, for each real multiplier near or below -1, starts on both sides of the gait along its eigenvector.

    At a period doubling the gait of doubled period branches off along the eigenvector of the multiplier -1.

    Parameters
    ----------
    cycle : Cycle
    scale : (n_z,) array
        Natural size of each coordinate of the gait's section.

    Yields
    ------
    z : (n_z,) array
        Point of the gait's section.
    displacement : float
        Its distance from the gait relative to the natural size.
    """
    if not np.all(np.isfinite(cycle.derivative)):
        return
    values, vectors = np.linalg.eig(cycle.derivative)
    for value, vector in zip(values, vectors.T, strict=True):
        if abs(value.imag) == 0 and value.real < FLIP_MULTIPLIER:
            unit = vector.real / np.max(np.abs(vector.real) / scale)
            yield from ((cycle.z + sign * size * unit, size) for size in DISPLACEMENTS for sign in (1, -1))
