"""Exact absolute work in intervals in which a joint power changes its sign.

Without further data the mean of the absolute Bernstein coefficients bounds the mean absolute power of an interval.  The
bound exceeds the mean if the sign changes inside.  Let b be the coefficients, c the zeros and sigma(s) the sign of the
power in a solution.  About that solution the mean absolute power is

    beta b + sum over the zeros of p(c)^2 / |p'(c)|,    beta_k = integral of sigma B_k,

up to third order, because the zeros move with the power and the power vanishes there.  The data of an interval replace
the bound by this expression as long as no coefficient changes its sign; beyond that, the expression increases like the
bound, so that the cost is bounded from below.
"""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.layout import Index, Layout
from gaitopt.ocp.transcription.bernstein import (
    bernstein_basis,
    derivative_at,
    integrate_basis,
    zeros_inside,
)
from gaitopt.ocp.transcription.grid import Phase

MAX_ZEROS = 2
"""Number of sign changes per interval and actuator whose movement is included in the data."""

NEGLIGIBLE_WORK = 1e-6
"""Share of the work of the step below which the excess of a bound is ignored: idle joints have powers near zero."""

LEAST_SLOPE = 1e-3
"""Least slope at a zero relative to the largest coefficient; at smaller slopes the expansion is invalid."""


@dataclass(frozen=True, eq=False)
class SignChangeLayout:
    """Places of the data on sign changes in the data vector of an NLP.

    Attributes
    ----------
    first, size : int
        First index and number of the data.
    tables : dict of int to (n, count) int array
        Indices by number of the phase: columns are intervals, rows are, for each actuator that is not idle, the linear
        terms of the coefficients and a weighted basis for each of `MAX_ZEROS` zeros.
    """

    first: int
    size: int
    tables: dict[int, Index]


def lay_out_sign_changes(phases: Sequence[Phase], first: int, actuators: int, points: int) -> SignChangeLayout:
    """Return the layout of the data of some phases.

    Parameters
    ----------
    phases : sequence of Phase
    first : int
        Index of the first datum.
    actuators, points : int
        Number of actuators that are not idle, and of Bernstein coefficients of an interval.
    """
    tables, size = {}, 0
    for phase in phases:
        shape = (actuators * (1 + MAX_ZEROS) * points, phase.count)
        tables[phase.number] = first + size + np.arange(shape[0] * shape[1]).reshape(shape)
        size += shape[0] * shape[1]
    return SignChangeLayout(first, size, tables)


def mean_parts(parts: Sequence[ca.SX], powers: Sequence[ca.SX], data: ca.SX) -> ca.SX:
    """Return the means of the positive and of the negative parts of the joint powers over an interval.

    Parameters
    ----------
    parts : sequence of SX, shape (2 n, 1)
        Unknown parts of the Bernstein coefficients of n powers: positive parts, then negative parts.
    powers : sequence of SX, shape (n, 1)
        The Bernstein coefficients as functions of the motion.
    data : SX
        Data on sign changes; if they are zero, the means are upper bounds.
    """
    points, n = len(powers), powers[0].numel()
    table, both, coefficients = ca.reshape(data, points, -1).T, ca.horzcat(*parts), ca.horzcat(*powers)
    linear, *bases = (table[i :: 1 + MAX_ZEROS, :] for i in range(1 + MAX_ZEROS))  # rows are actuators
    movement = sum((ca.sum2(basis * coefficients) ** 2 for basis in bases), ca.SX(0))
    correction = (ca.sum2(linear * (both[:n, :] - both[n:, :])) + movement) / 2
    return ca.sum2(both) / points + ca.vertcat(correction, correction)


def locate_sign_changes(
    layout: SignChangeLayout, variables: Layout, phases: Sequence[Phase], x: Array, *, touching: bool
) -> Array:
    """Return the data on the sign changes of a solution, shape (layout.size,).

    Parameters
    ----------
    layout : SignChangeLayout
    variables : Layout
        Layout of the decision vector.
    phases : sequence of Phase
    x : (n_variables,) array
        Decision vector, whose parts of the powers satisfy their equations.
    touching : bool
        Whether intervals are included whose coefficients differ in sign although the power does not.  The work is then
        exact at the solution, but underestimated near it if the power touches zero.
    """
    data = np.zeros(layout.size)
    if not layout.size or not np.all(np.isfinite(x)):
        return data
    lengths = [x[variables[Unknown.DURATION][0, phase.number]] * phase.shares[:, None] for phase in phases]
    powers = [_coefficients(variables, phase, x) for phase in phases]
    bounds = [length * np.abs(power).mean(axis=0) for length, power in zip(lengths, powers, strict=True)]
    total = sum(bound.sum() for bound in bounds)
    for phase, bound, power in zip(phases, bounds, powers, strict=True):
        points, count, n = power.shape
        table = np.zeros((count, n, 1 + MAX_ZEROS, points))
        mixed = (power.min(axis=0) < 0) & (power.max(axis=0) > 0)
        relevant = mixed & (bound > NEGLIGIBLE_WORK * total)
        for k, j in np.argwhere(relevant):
            zeros = zeros_inside(power[:, k, j])
            if zeros or touching:
                table[k, j] = _expand_absolute(power[:, k, j], zeros)
        data[layout.tables[phase.number].T - layout.first] = table.reshape(count, -1)
    return data


def _coefficients(variables: Layout, phase: Phase, x: Array) -> Array:
    """Return the Bernstein coefficients of the powers, shape (n_points, n_intervals, n_actuators)."""
    nodes, inner = variables[Unknown.POWER][:, list(phase.nodes)], variables[Unknown.INNER_POWER, phase.number]
    n = nodes.shape[0] // 2
    parts = np.concatenate([x[nodes[:, :-1]][None], x[inner].reshape(-1, 2 * n, phase.count), x[nodes[:, 1:]][None]])
    return np.swapaxes(parts[:, :n] - parts[:, n:], 1, 2)


def _expand_absolute(coefficients: Array, zeros: list[float]) -> Array:
    """Return the linear terms and the weighted bases of the zeros of one power, shape (1 + MAX_ZEROS, n_points)."""
    points = coefficients.size
    table = np.zeros((1 + MAX_ZEROS, points))
    ends = np.array([0.0, *zeros, 1.0])
    integrals = np.diff([integrate_basis(end, points) for end in ends], axis=0)
    signs = np.sign(integrals @ coefficients)
    table[0] = signs @ integrals - np.sign(coefficients) / points
    changes = [zero for zero, before, after in zip(zeros, signs, signs[1:], strict=False) if before != after]
    least = LEAST_SLOPE * np.abs(coefficients).max()
    for row, zero in enumerate(changes[:MAX_ZEROS], start=1):
        slope = max(abs(derivative_at(coefficients, zero)), least)
        table[row] = bernstein_basis(zero, points - 1) / np.sqrt(slope)
    return table
