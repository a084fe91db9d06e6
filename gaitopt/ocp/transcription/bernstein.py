"""Bernstein polynomials: the power of an actuator within an interval.

The power in an interval is represented by the polynomial through its values at the points of the scheme, in the
Bernstein basis.  The basis polynomials are non-negative and have equal integrals, so the mean of the absolute
coefficients is an upper bound of the mean absolute power, and equal to it if no two coefficients differ in sign
(G. Farin, Curves and Surfaces for CAGD, 5th ed., section 5.1).
"""

import functools
import math

import numpy as np

from gaitopt.motion.motion import Array


def bernstein_basis(at: float, degree: int) -> Array:
    """Return the values of the Bernstein polynomials at a fraction of the interval, shape (degree + 1,)."""
    k = np.arange(degree + 1)
    return np.asarray([math.comb(degree, i) for i in k] * at**k * (1.0 - at) ** (degree - k))


@functools.cache
def bernstein_transformation(fractions: tuple[float, ...]) -> Array:
    """Return the matrix from the values of a polynomial at some fractions of the interval to its coefficients."""
    degree = len(fractions) - 1
    return np.asarray(np.linalg.inv([bernstein_basis(at, degree) for at in fractions]))


@functools.cache
def hermite_transformation(fractions: tuple[float, ...], at: tuple[float, ...]) -> Array:
    """Return the matrix from values at some fractions, then slopes at the first and the last, to values elsewhere.

    The polynomial with these values and slopes is evaluated; the matrix has shape (len(at), len(fractions) + 2).
    """
    count = len(fractions) + 2
    values = np.vander(fractions, count, increasing=True)
    ends = np.vander([fractions[0], fractions[-1]], count, increasing=True)
    slopes = np.hstack([np.zeros((2, 1)), ends[:, :-1] * np.arange(1, count)])
    return np.vander(at, count, increasing=True) @ np.linalg.inv(np.vstack([values, slopes]))


def integrate_basis(upto: float, points: int) -> Array:
    """Return the integrals of the Bernstein polynomials from 0 to a fraction of the interval, shape (points,).

    Examples
    --------
    >>> integrate_basis(1.0, 2)
    array([0.5, 0.5])
    """
    return np.asarray(np.cumsum(bernstein_basis(upto, points)[:0:-1])[::-1]) / points


def derivative_at(coefficients: Array, at: float) -> float:
    """Return the derivative of a polynomial with Bernstein coefficients at a fraction of the interval."""
    degree = coefficients.size - 1
    return degree * float(np.dot(np.diff(coefficients), bernstein_basis(at, degree - 1)))


def zeros_inside(coefficients: Array) -> list[float]:
    """Return the real zeros of a polynomial with Bernstein coefficients strictly between 0 and 1, in order.

    Examples
    --------
    >>> zeros_inside(np.array([-1.0, 1.0]))
    [0.5]
    """
    zeros = np.roots(_monomials(coefficients.size) @ coefficients)
    real = np.sort(zeros[np.abs(zeros.imag) < 1e-9].real)
    return [float(zero) for zero in real if 0 < zero < 1]


@functools.cache
def _monomials(count: int) -> Array:
    """Return the matrix from Bernstein coefficients to those of the powers, highest first, shape (count, count)."""
    degree, matrix = count - 1, np.zeros((count, count))
    for k in range(count):
        for i in range(k, count):  # B_k = sum over i of (-1)^(i - k) C(degree, i) C(i, k) s^i
            matrix[degree - i, k] = (-1) ** (i - k) * math.comb(degree, i) * math.comb(i, k)
    return matrix
