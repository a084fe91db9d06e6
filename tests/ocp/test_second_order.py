"""Second-order conditions of small NLPs whose minima, saddles and vertices are known in closed form."""

import casadi as ca
import numpy as np
import pytest

from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.ocp.nlp.second_order import Verdict, check_second_order
from gaitopt.progress import silent

X, Y = ca.SX.sym("x"), ca.SX.sym("y")
FREE = (-np.inf, np.inf)


def check(cost, *, start=(0.3, 0.4), rows=(), bounds=(FREE, FREE), row_bounds=(), smooth=False, sizes=None):
    """Solve an NLP in (x, y) and return the point reached and its check."""
    block = Block(
        name="toy",
        variables=ca.vertcat(X, Y),
        cost=cost,
        constraints=ca.vertcat(*rows) if rows else ca.SX(0, 1),
        columns=np.array([[0], [1]]),
        rows=np.arange(len(rows))[:, None],
    )
    nlp = assemble_nlp([block], ca.SX.sym("z", 1), 2, len(rows), smooth=smooth)
    (x_lower, x_upper), (g_lower, g_upper) = np.array(bounds, dtype=float).T, np.reshape(row_bounds, (-1, 2)).T
    limits, data = Bounds(x_lower, x_upper, g_lower, g_upper), np.array([0.0])
    result = Ipopt().minimise(nlp, np.array(start), data, limits, silent)
    assert result.status.ok
    return result.x, check_second_order(nlp, result.x, result.multipliers, data, limits, sizes)


@pytest.mark.parametrize("smooth", [True, False])
def test_a_strictly_convex_minimum_is_strict(smooth):
    x, result = check((X - 1) ** 2 + 3 * Y**2, smooth=smooth)
    assert x == pytest.approx([1, 0], abs=1e-8)
    assert (result.verdict, result.free_directions, result.dependent) == (Verdict.STRICT, 2, 0)
    assert result.curvature == pytest.approx(2.0)
    assert result.active.size == 0


def test_a_constraint_makes_an_indefinite_hessian_definite():
    """x y on the circle x^2 + y^2 = 2 has its minimum at x = -y; the Hessian of x y alone is indefinite.

    With the multiplier 1/2 the Lagrangian's Hessian is [[1, 1], [1, 1]], which is 2 along the tangent (1, 1) / sqrt 2.
    """
    x, result = check(X * Y, start=(0.9, -1.3), rows=[X**2 + Y**2], row_bounds=[(2, 2)])
    assert x == pytest.approx([1, -1], abs=1e-7)
    assert (result.verdict, result.free_directions) == (Verdict.STRICT, 1)
    assert result.curvature == pytest.approx(2.0, abs=1e-6)


def test_curvature_is_judged_in_typical_sizes_of_the_unknowns():
    """The unit of an unknown does not change the verdict: x is of order 1e6 in the second form."""
    cost = (X / 1e6) ** 2 + Y**2
    assert check(cost, smooth=True)[1].verdict is Verdict.UNDECIDED
    result = check(cost, smooth=True, sizes=np.array([1e6, 1.0]))[1]
    assert result.verdict is Verdict.STRICT
    assert result.curvature == pytest.approx(2.0)


def test_a_vertex_of_a_linear_program_is_sharp():
    x, result = check(-2 * X - Y, rows=[X + Y], row_bounds=[(-np.inf, 1)], bounds=((0, 0.75), (0, np.inf)))
    assert x == pytest.approx([0.75, 0.25], abs=1e-6)
    assert (result.verdict, result.free_directions, result.active.size, result.weak.size) == (Verdict.SHARP, 0, 2, 0)
    assert result.slacks[1] == pytest.approx(0.25, abs=1e-6)  # of y from its lower bound


def test_an_edge_of_minima_is_undecided():
    """Every point of the edge x + y = 1 has the same cost."""
    _, result = check(-X - Y, rows=[X + Y], row_bounds=[(-np.inf, 1)], bounds=((0, 2), (0, 2)))
    assert (result.verdict, result.free_directions) == (Verdict.UNDECIDED, 1)


def test_a_fourth_power_is_undecided():
    _, result = check((X - 1) ** 2 + Y**4, start=(0.5, 0.0))
    assert result.verdict is Verdict.UNDECIDED


def test_a_saddle_is_no_minimum():
    """Started on the ridge y = 0, Newton's method reaches the saddle of x^2 - y^2 + y^4."""
    x, result = check(X**2 - Y**2 + Y**4, start=(0.3, 0.0))
    assert x == pytest.approx([0, 0], abs=1e-7)
    assert (result.verdict, result.curvature) == (Verdict.SADDLE, pytest.approx(-2.0))


def test_dependent_constraints_are_counted():
    """Three active constraints meet at the vertex (1, 1) of two unknowns."""
    x, result = check(
        -X - 2 * Y, rows=[X + Y], row_bounds=[(-np.inf, 2)], bounds=((-np.inf, 1), (-np.inf, 1)), start=(0, 0)
    )
    assert x == pytest.approx([1, 1], abs=1e-6)
    assert (result.verdict, result.active.size, result.dependent) == (Verdict.SHARP, 3, 1)


def test_active_constraints_without_multiplier_exclude_a_saddle():
    """At (0, 0) the cost x^2 - y^2 has no slope, so none of the three constraints on y has a multiplier."""
    block = Block(
        name="toy",
        variables=ca.vertcat(X, Y),
        cost=X**2 - Y**2,
        constraints=ca.vertcat(Y, -Y),
        columns=np.array([[0], [1]]),
        rows=np.arange(2)[:, None],
    )
    limits = Bounds(np.array([-np.inf, 0]), np.full(2, np.inf), np.array([0, -np.inf]), np.array([np.inf, 0]))
    nlp, data = assemble_nlp([block], ca.SX.sym("z", 1), 2, 2, smooth=True), np.array([0.0])
    result = check_second_order(nlp, np.zeros(2), (np.zeros(2), np.zeros(2)), data, limits)
    assert (result.verdict, result.weak.size, result.dependent) == (Verdict.UNDECIDED, 3, 2)
    assert (result.free_directions, result.curvature) == (2, pytest.approx(-2.0))


@pytest.mark.parametrize(("lower", "expected"), [(0.99, Verdict.STRICT), (-1.0, Verdict.SADDLE)])
def test_a_bound_that_is_almost_active_excludes_a_saddle_unless_the_cost_decreases_beyond_it(lower, expected):
    """An interior-point method left y at 4e-6 from its bound 1, with a multiplier of 3e-6, which is less.

    Away from the bound by d the cost changes by 3e-6 d - 5e-5 d^2, which is positive up to d = 0.06.
    """
    block = Block(
        name="toy",
        variables=ca.vertcat(X, Y),
        cost=X**2 + 3e-6 * (1 - Y) - 5e-5 * (1 - Y) ** 2,
        constraints=ca.SX(0, 1),
        columns=np.array([[0], [1]]),
        rows=np.empty((0, 1), dtype=int),
    )
    limits = Bounds(np.array([-np.inf, lower]), np.array([np.inf, 1.0]), np.empty(0), np.empty(0))
    nlp, data = assemble_nlp([block], ca.SX.sym("z", 1), 2, 0, smooth=True), np.array([0.0])
    multipliers = (np.array([0.0, 3e-6]), np.empty(0))
    result = check_second_order(nlp, np.array([0.0, 1 - 4e-6]), multipliers, data, limits)
    assert result.verdict is expected
    assert (result.curvature > 0) == (expected is Verdict.STRICT)


def test_nearly_dependent_constraints_exclude_a_saddle():
    """The constraints x = y and x = y - 1e-9 y fix both, with multipliers of 4e9; the cost has a slope along (1, 1)."""
    block = Block(
        name="toy",
        variables=ca.vertcat(X, Y),
        cost=X + 3 * Y - Y**2,
        constraints=ca.vertcat(X - Y, X - Y + 1e-9 * Y),
        columns=np.array([[0], [1]]),
        rows=np.arange(2)[:, None],
    )
    limits = Bounds(np.full(2, -np.inf), np.full(2, np.inf), np.zeros(2), np.zeros(2))
    nlp, data = assemble_nlp([block], ca.SX.sym("z", 1), 2, 2, smooth=True), np.array([0.0])
    multipliers = (np.zeros(2), np.array([4e9 - 1, -4e9]))
    result = check_second_order(nlp, np.zeros(2), multipliers, data, limits)
    assert (result.verdict, result.free_directions) == (Verdict.UNDECIDED, 1)
