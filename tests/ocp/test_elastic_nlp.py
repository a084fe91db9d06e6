"""An elastic NLP: derivatives against CasADi's own, and slacks of examples that are solved by hand."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Ipopt
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.elastic import ElasticNlp, RelaxedSide
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.progress import silent

INF = np.inf
NONE = np.empty(0)


def small_nlp(constraints, count):
    x = ca.SX.sym("x", count)
    expression = constraints(x)
    columns, rows = np.arange(count)[:, None], np.arange(expression.numel())[:, None]
    block = Block(name="block", variables=x, cost=ca.sumsqr(x), constraints=expression, columns=columns, rows=rows)
    return assemble_nlp([block], ca.SX.sym("z", 0), count, expression.numel())


def elastic(nlp, bounds, sides):
    n = nlp.n_variables
    return ElasticNlp(nlp, bounds, tuple(sides), np.ones(n), np.full(n, -INF))


@pytest.fixture(scope="module")
def product():
    """x0 x1 = 12 with 0 <= x <= 3 (limit 0), and x0 + x1 <= 8 (limit 1)."""
    nlp = small_nlp(lambda x: ca.vertcat(x[0] * x[1], x[0] + x[1]), 2)
    bounds = Bounds(np.zeros(2), np.full(2, 3.0), np.array([12.0, -INF]), np.array([12.0, 8.0]))
    sides = [RelaxedSide(0, False, i, False) for i in range(2)] + [RelaxedSide(1, True, 1, False, scale=2.0)]
    return elastic(nlp, bounds, sides)


def test_a_common_slack_is_the_least_excess_over_a_limit(product):
    """Both bounds must be exceeded by sqrt(12) - 3; the proximal term of weight 1e-4 does not change that."""
    result = product.minimise(np.array([2.0, 2.5]), NONE, np.ones(2), Ipopt(), silent)
    assert result.status.ok
    assert result.x == pytest.approx(np.sqrt(12) * np.ones(2), abs=1e-3)
    assert result.slacks == pytest.approx([np.sqrt(12) - 3, 0], abs=1e-4)
    assert result.active == pytest.approx([1, 0], abs=1e-4)


def test_a_limit_at_a_prohibitive_price_is_kept(product):
    nlp, inner = product.nlp, np.array([2.0, 2.5])
    lower = Bounds(np.zeros(2), np.full(2, 3.0), np.array([12.0, -INF]), np.array([12.0, 5.0]))
    sides = [RelaxedSide(0, False, i, False) for i in range(2)] + [RelaxedSide(1, True, 1, False, scale=2.0)]
    result = elastic(product._original, lower, sides).minimise(inner, NONE, np.array([100, 1]), Ipopt(), silent)
    assert nlp.n_variables == 4
    # The least sum at a product of 12 is 2 sqrt(12), with both unknowns beyond 3: no price is high enough for that.
    assert result.slacks == pytest.approx([np.sqrt(12) - 3, (2 * np.sqrt(12) - 5) / 2], abs=1e-3)


def test_a_feasible_problem_has_no_excess(product):
    bounds = Bounds(np.zeros(2), np.full(2, 4.0), np.array([12.0, -INF]), np.array([12.0, 8.0]))
    sides = product.sides
    result = elastic(product._original, bounds, sides).minimise(np.ones(2), NONE, np.ones(2), Ipopt(), silent)
    assert result.slacks == pytest.approx([0, 0], abs=1e-7)
    assert result.x[0] * result.x[1] == pytest.approx(12)


def test_excesses_name_the_side_that_is_exceeded_most(product):
    excesses, sides = product.find_excesses(np.array([4.0, 6.0]), NONE)
    assert excesses == pytest.approx([3, 1])  # 6 - 3, and (10 - 8) per unit of 2
    assert (sides[0].index, sides[1].is_row) == (1, True)
    assert product.find_excesses(np.array([1.0, 2.0]), NONE)[1] == [None, None]


def test_multipliers_of_a_fixed_value_cancel():
    """x0 is fixed at 1 by two sides of limit 0; nothing else acts on it, so neither side is active."""
    nlp = small_nlp(lambda x: x[0] + x[1], 2)
    bounds = Bounds(np.array([1.0, -INF]), np.array([1.0, INF]), np.array([-INF]), np.array([10.0]))
    sides = [RelaxedSide(0, False, 0, True), RelaxedSide(0, False, 0, False)]
    result = elastic(nlp, bounds, sides).minimise(np.array([1.0, 0.0]), NONE, np.ones(1), Ipopt(), silent)
    assert result.active == pytest.approx([0], abs=1e-6)


def test_the_least_bounds_remain():
    nlp = small_nlp(lambda x: x[0] - x[1], 2)
    bounds = Bounds(np.full(2, 1.0), np.full(2, 9.0), np.array([-INF]), np.array([-20.0]))
    sides = (RelaxedSide(0, False, 0, True), RelaxedSide(0, False, 1, False), RelaxedSide(1, True, 0, False))
    held = ElasticNlp(nlp, bounds, sides, np.ones(2), np.array([0.5, -INF]))
    result = held.minimise(np.full(2, 2.0), NONE, np.array([1.0, 100.0]), Ipopt(), silent)
    assert result.x[0] == pytest.approx(0.5, abs=1e-4)
    assert result.x[1] == pytest.approx(20.5, abs=1e-3)


def test_derivatives(product):
    nlp, rng = product.nlp, np.random.default_rng(2)
    x, z = rng.uniform(1, 2, nlp.n_variables), rng.uniform(1, 2, nlp.functions["p"].numel())
    weight, multipliers = 0.6, rng.standard_normal(nlp.n_constraints)
    symbol, data = nlp.functions["x"], nlp.functions["p"]
    lagrangian = weight * nlp.functions["f"] + ca.dot(multipliers, nlp.functions["g"])
    expressions = [
        ca.gradient(nlp.functions["f"], symbol),
        ca.jacobian(nlp.functions["g"], symbol),
        ca.triu(ca.hessian(lagrangian, symbol)[0]),
    ]
    expected = ca.Function("expected", [symbol, data], expressions)(x, z)
    found = (
        nlp.derivatives["grad_f"](x, z)[1],
        nlp.derivatives["jac_g"](x, z)[1],
        nlp.derivatives["hess_lag"](x, z, weight, multipliers),
    )
    for one, other in zip(found, expected, strict=True):
        assert np.asarray(one.full()) == pytest.approx(np.asarray(other.full()), abs=1e-12)
