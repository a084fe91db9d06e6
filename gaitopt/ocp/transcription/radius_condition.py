"""Bound of the spectral radius by the characteristic polynomial of the return map.

The coefficients of the polynomial are smooth functions of the matrix, also where multipliers coalesce.  Its zeros have
moduli of at most r if and only if Jury's conditions hold for the polynomial with the coefficients c_k / r^k; for three
zeros z^3 + a_2 z^2 + a_1 z + a_0 these are

    1 + a_2 + a_1 + a_0 >= 0,  1 - a_2 + a_1 - a_0 >= 0,  abs(a_0) <= 1,  1 - a_1 + a_0 a_2 - a_0^2 >= 0

(Jury, Theory and Application of the z-Transform Method, 1964).  The last one is the product of 1 - z_i z_j over the
pairs of zeros, so it has a simple zero where a complex pair reaches the circle.  With abs(a_0) = 1 the conditions also
hold for zeros such as 2, 1 and 1/2, so abs(a_0) is kept below 1 by a margin.  The conditions are multiplied by r^3,
because the coefficients are divided by powers of the radius r, which may be small.
"""

import math

import casadi as ca

from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import STEP, Group, Key, Kind, Row, Unknown
from gaitopt.ocp.transcription.deviations import SectionNames
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder

MARGIN = 0.01
"""Least distance of the product of three zeros from 1, in units of the bound to the third power."""

STRICTNESS = 2e-7
"""Least value of the other conditions, above the tolerance of a solver: where zeros coalesce on the circle, they change
by the square root of a violation."""

RELAXATION = 1e-8
"""Violation of an inequality that a solver accepts."""


def radius_block(builder: NlpBuilder, section: SectionNames, weight: float) -> Block:
    """Return the block that bounds the spectral radius of the return map, with its weight in the objective."""
    local, count = BlockVariables(builder, 1), len(section.names)
    after = local.add("return", builder.variables[Unknown.RETURN])
    radius = local.add("radius", builder.variables[Unknown.RADIUS])
    matrix = ca.reshape(after, len(section.state), count)[section.kept, :]
    coefficients = characteristic_coefficients(matrix, count - section.vanishing)
    values = jury_conditions([c / radius ** (k + 1) for k, c in enumerate(coefficients)]) - STRICTNESS
    values *= radius ** len(coefficients)
    table = [Row(Key(Kind.RADIUS_CONDITION, str(i + 1)), RELAXATION, math.inf) for i in range(values.numel())]
    rows = builder.rows.add(Group.RADIUS, table, [STEP])
    return local.block("radius", values, rows, weight * radius if weight else None)


def characteristic_coefficients(matrix: ca.SX, degree: int) -> list[ca.SX]:
    """Return the coefficients c_1, ..., c_degree of z^n + c_1 z^(n-1) + ... (method of Faddeev and LeVerrier).

    Examples
    --------
    >>> [float(ca.DM(c)) for c in characteristic_coefficients(ca.SX([[2, 0], [0, 3]]), 2)]
    [-5.0, 6.0]
    """
    coefficients, product = [], matrix
    for k in range(1, degree + 1):
        coefficients.append(-ca.trace(product) / k)
        if k < degree:
            product = matrix @ (product + coefficients[-1] * ca.SX.eye(matrix.size1()))
    return coefficients


def jury_conditions(a: list[ca.SX]) -> ca.SX:
    """Return values that are nonnegative only if the zeros of z^m + a[0] z^(m-1) + ... lie in the unit circle, m <= 3.

    They are so for all such zeros whose product is at most 1 - MARGIN.

    Examples
    --------
    >>> float(ca.mmin(ca.evalf(jury_conditions([ca.SX(0.5)])))), float(ca.mmin(ca.evalf(jury_conditions([ca.SX(2)]))))
    (0.5, -1.0)
    """
    if len(a) == 1:
        return ca.vertcat(1 + a[0], 1 - a[0])
    if len(a) == 2:
        return ca.vertcat(1 + a[0] + a[1], 1 - a[0] + a[1], 1 - a[1])
    second, first, zeroth = a
    return ca.vertcat(
        1 + second + first + zeroth,
        1 - second + first - zeroth,
        1 - MARGIN + zeroth,
        1 - MARGIN - zeroth,
        1 - first + zeroth * second - zeroth**2,
    )
