"""Starts for gaits of doubled period near a gait with a negative real multiplier.

At a period doubling the gait of doubled period branches off along the eigenvector of the multiplier -1.
"""

from collections.abc import Iterator

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.return_map import ReturnMap

FLIP_MULTIPLIER = -0.7
"""Real multiplier below which starts are generated: near -1, because a period doubling may be subcritical."""
DISPLACEMENTS = (0.01, 0.03, 0.1, 0.3)
"""Displacements along an eigenvector relative to the natural size of the coordinates."""
AMPLITUDES = tuple(np.geomspace(0.003, 0.4, 12))
"""Displacements between which the amplitude of a gait of doubled period is located."""


def doubled_starts(cycle: Cycle, scale: Array) -> Iterator[tuple[Array, float]]:
    """Yield, for each real multiplier near or below -1, starts on both sides of the gait along its eigenvector.

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
    for direction, _ in _flip_directions(cycle, scale):
        yield from ((cycle.z + sign * size * direction, size) for size in DISPLACEMENTS for sign in (1, -1))


def locate_doubled_gaits(cycle: Cycle, scale: Array, return_map: ReturnMap) -> Iterator[tuple[Array, float]]:
    """Yield points near gaits of doubled period: where the doubled map leaves the displacement unchanged.

    Along the eigenvector v with the left eigenvector w, w . (P(z + a v) - z - a v) / a changes its sign near the
    amplitude a of such a gait, up to terms of order a^2 in the other directions.

    Parameters
    ----------
    cycle : Cycle
    scale : (n_z,) array
        Natural size of each coordinate of the gait's section.
    return_map : ReturnMap
        Map P of twice the period of the gait on its section.

    Yields
    ------
    z : (n_z,) array
        Point of the gait's section.
    displacement : float
        Its distance from the gait relative to the natural size.
    """
    for direction, left in _flip_directions(cycle, scale):
        before, growth_before = 0.0, np.nan
        for amplitude in AMPLITUDES:
            z = cycle.z + amplitude * direction
            end = return_map(z).end
            growth = np.nan if end is None else float(left @ (end - z)) / amplitude
            if growth * growth_before < 0:
                size = before + (amplitude - before) * growth_before / (growth_before - growth)
                yield cycle.z + size * direction, size
            before, growth_before = amplitude, growth


def _flip_directions(cycle: Cycle, scale: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the eigenvector of each real multiplier near or below -1, of natural size 1, and its left eigenvector."""
    if not np.all(np.isfinite(cycle.derivative)):
        return
    values, vectors = np.linalg.eig(cycle.derivative)
    for value, vector in zip(values, vectors.T, strict=True):
        if abs(value.imag) == 0 and value.real < FLIP_MULTIPLIER:
            rows, columns = np.linalg.eig(cycle.derivative.T)
            left = columns[:, np.argmin(np.abs(rows - value))].real
            direction = vector.real / np.max(np.abs(vector.real) / scale)
            yield direction, left / (left @ direction)
