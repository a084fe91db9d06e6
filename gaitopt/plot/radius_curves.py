"""Curves of the spectral radius between the gaits of a branch, which may be far apart."""

import itertools

import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.branch_diagram import GaitBranch, distinct_steps
from gaitopt.motion.motion import Array

PARTS = 12
"""Number of parts of the curve between two gaits."""

LEAST_DISTANCE = 1e-4
"""Distance along a branch, over its length, below which the second of two gaits is not a node of the interpolation."""


def interpolate_radii(branch: GaitBranch) -> list[tuple[Array, Array]]:
    """Return the curve of the spectral radius between each gait of a branch and the next one.

    The characteristic polynomials of the multipliers are interpolated, whose coefficients are smooth along a branch.
    The radius itself is not smooth: it has kinks where the largest multiplier changes its sign or becomes complex.

    Parameters
    ----------
    branch : GaitBranch

    Returns
    -------
    list of (values, radii)
        Arrays of equal length, which begin and end with a gait; between gaits of different contact sequences, these two
        alone.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> branch = load_diagram("docs/examples/compass_slope.nc").branches[3]
    >>> float(branch.radii.min()) > 0.1  # the largest multiplier is zero between two gaits
    True
    >>> float(min(radii.min() for _, radii in interpolate_radii(branch))) < 0.03
    True
    """
    curves = [(branch.values[k : k + 2], branch.radii[k : k + 2]) for k in range(branch.values.size - 1)]
    names = [distinct_steps(name) for name in branch.sequences]
    begin = 0
    for _, group in itertools.groupby(names):
        end = begin + len(list(group))
        curves[begin : end - 1] = _interpolate_run(branch, slice(begin, end))
        begin = end
    return curves


def _interpolate_run(branch: GaitBranch, run: slice) -> list[tuple[Array, Array]]:
    """Return the curves between the gaits of a run of one contact sequence."""
    from scipy.interpolate import PchipInterpolator  # monotone between two gaits, where a cubic spline may overshoot

    values, radii = branch.values[run], branch.radii[run]
    if values.size < 2:
        return []
    place = _measure_distances(branch)[run]
    nodes = _select_nodes(place)
    if len(nodes) < 2:
        return [(values[k : k + 2], radii[k : k + 2]) for k in range(values.size - 1)]
    polynomials = np.array([np.poly(row).real for row in np.nan_to_num(branch.multipliers[run])])[:, 1:]
    spline = PchipInterpolator(place[nodes], np.column_stack([values, polynomials])[nodes])
    curves = []
    for k, (one, other) in enumerate(itertools.pairwise(place)):
        between = spline(np.linspace(one, other, PARTS + 1)[1:-1])
        inner = np.max(np.abs(_find_roots(between[:, 1:])), axis=1)
        curves.append(
            (np.array([values[k], *between[:, 0], values[k + 1]]), np.array([radii[k], *inner, radii[k + 1]]))
        )
    return curves


def _measure_distances(branch: GaitBranch) -> Array:
    """Return the distance of each gait from the first one along a branch, in ranges of the parameter and the state."""
    rows = np.column_stack([branch.values, branch.states])
    ranges = np.ptp(rows, axis=0)
    lengths = np.linalg.norm(np.diff(rows, axis=0) / np.where(ranges > 0, ranges, 1.0), axis=1)
    return np.insert(np.cumsum(lengths), 0, 0.0)


def _select_nodes(place: Array) -> list[int]:
    """Return the numbers of gaits whose places along a branch are clearly apart."""
    nodes = [0]
    for k in range(1, place.size):
        if place[k] - place[nodes[-1]] > LEAST_DISTANCE * (place[-1] - place[0]):
            nodes.append(k)
    return nodes


def _find_roots(coefficients: Array) -> NDArray[np.complex128]:
    """Return the roots of monic polynomials, shape (K, n), from the coefficients after the first, shape (K, n)."""
    count, degree = coefficients.shape
    companions = np.zeros((count, degree, degree))
    companions[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    companions[:, 0] = -coefficients
    return np.asarray(np.linalg.eigvals(companions), complex)
