"""Blocks: derivatives through intermediate quantities, and Functions shared by blocks with equal expressions."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, compass_biped
from gaitopt.ocp.bounds import structure
from gaitopt.ocp.nlp.block import Block, BlockFunctions, derive_block
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.ocp.transcription.transcription import transcribe

DATA = ca.SX.sym("z")
W = ca.SX.sym("w", 3)


def intermediate_block(*, eliminated):
    """Return a block of W whose functions contain W0 W1 and sin(W2), as symbols or `eliminated`."""
    s, definitions = ca.SX.sym("s", 2), ca.vertcat(W[0] * W[1], ca.sin(W[2]))
    parts = [s[0] ** 2 * W[2] + DATA * s[1], ca.exp(s[0]) * s[1], ca.vertcat(s[0] * s[1], W[0] ** 3, s[1] ** 2 + W[1])]
    if eliminated:
        parts = ca.substitute(parts, [s], [definitions])
        s = definitions = ca.SX(0, 1)
    cost, penalty, constraints = parts
    return Block(
        name="block",
        variables=W,
        cost=cost,
        penalty=penalty,
        constraints=constraints,
        columns=np.array([[0, 2], [1, 2], [2, 3]]),  # in the second instance W0 and W1 are the same unknown
        rows=np.array([[0, 1], [1, 2], [2, 3]]),
        intermediates=s,
        definitions=definitions,
    )


def test_derivatives_through_intermediates_are_those_of_the_functions_themselves(rng):
    one, two = (assemble_nlp([intermediate_block(eliminated=kind)], DATA, 4, 4) for kind in (False, True))
    x, multipliers, weight = rng.normal(size=4), rng.normal(size=4), 0.7
    for name, arguments in (("grad_f", ()), ("jac_g", ()), ("hess_lag", (weight, multipliers))):
        pairs = zip(*(nlp.derivatives[name].call([x, 0.3, *arguments]) for nlp in (one, two)), strict=True)
        for through, direct in pairs:
            np.testing.assert_allclose(np.asarray(through), np.asarray(direct), rtol=1e-13, atol=1e-13)
    f, g = one.values(x, 0.3)
    np.testing.assert_array_equal(np.asarray(g), np.asarray(one.derivatives["jac_g"](x, 0.3)[0]))
    assert float(f) == pytest.approx(float(two.values(x, 0.3)[0]), rel=1e-14)


def test_the_gradient_is_dense_if_some_unknowns_are_not_in_the_cost():
    """Ipopt misreads a sparse gradient."""
    nlp = assemble_nlp([intermediate_block(eliminated=True)], DATA, 9, 4)
    assert nlp.derivatives["grad_f"].sparsity_out(1).is_dense()


def test_blocks_with_equal_expressions_share_their_functions():
    first, again, other = (intermediate_block(eliminated=kind) for kind in (False, False, True))
    assert derive_block(first, DATA) is derive_block(again, DATA)
    assert derive_block(first, DATA) is not derive_block(other, DATA)
    louder = Block(**{**vars(first), "cost": 2 * first.cost})
    assert derive_block(first, DATA) is not derive_block(louder, DATA)


def test_grids_share_the_derivatives_of_their_intervals(monkeypatch):
    problem = GaitProblem(robot=compass_biped(), sequence="slip+ stick | slip+", friction=0.14, limits=Limits(torque=6))
    transcribe.cache_clear()
    built = []
    monkeypatch.setattr(
        "gaitopt.ocp.nlp.nlp.derive_block", lambda *block: built.append(derive_block(*block)) or built[-1]
    )
    for intervals in (8, 16):
        transcribe(structure(problem, Collocation(intervals=intervals)))
    count = len(built) // 2
    assert [id(functions) for functions in built[:count]] == [id(functions) for functions in built[count:]]
    transcribe.cache_clear()


@pytest.fixture
def interval_block(monkeypatch):
    """Return the block of the intervals of a phase, and the shared data."""
    blocks = []
    monkeypatch.setattr("gaitopt.ocp.nlp.nlp.derive_block", lambda *block: blocks.append(block) or derive_block(*block))
    transcribe.cache_clear()
    problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.3, objective="torque_squared")
    transcribe(structure(problem, Collocation(intervals=4, points=5)))
    transcribe.cache_clear()
    return blocks[0]


def test_the_hessian_through_the_inner_states_needs_half_of_the_operations(interval_block):
    through, data = interval_block
    parts = ca.substitute([through.constraints, through.cost], [through.intermediates], [through.definitions])
    names = dict(zip(("constraints", "cost"), parts, strict=True))
    empty = dict.fromkeys(("intermediates", "definitions"), ca.SX(0, 1))
    direct = Block(**{**vars(through), **names, **empty})
    counts = [derive_block(block, data).hessian.n_instructions() for block in (through, direct)]
    assert counts[0] < 0.5 * counts[1]


def test_intervals_of_collocation_have_few_common_subexpressions(interval_block):
    block, data = interval_block
    kept, merged = (BlockFunctions(one, data) for one in (block, replace(block, merged=False).merge_subexpressions()))
    assert block.merged
    assert kept.hessian.n_instructions() < 1.04 * merged.hessian.n_instructions()


def test_a_row_with_many_variables_is_differentiated_on_its_own():
    w = ca.SX.sym("w", 12)
    rows = ca.vertcat(w[0] * w[1], ca.sumsqr(w), w[2] * w[3], ca.sin(w[4]))
    block = Block(
        name="block", variables=w, constraints=rows, columns=np.arange(12)[:, None], rows=np.arange(4)[:, None]
    )
    functions, x = BlockFunctions(block, DATA), np.linspace(0.1, 1.2, 12)
    slopes = functions.jacobian(x, 0.0)[1]
    expected = ca.Function("expected", [w], [ca.jacobian(rows, w)])(x)
    np.testing.assert_array_equal(slopes, np.asarray(expected)[functions.jacobian_entries][:, None])
