"""Sparse matrices of numbers, compared with dense ones, and the two factorisations of a system."""

import casadi as ca
import numpy as np
import pytest

from gaitopt.ocp.nlp import sparse_matrix
from gaitopt.ocp.nlp.sparse_matrix import SparseMatrix, factorise


def example(seed=0, shape=(6, 9)):
    rng = np.random.default_rng(seed)
    dense = rng.standard_normal(shape) * (rng.uniform(size=shape) < 0.4)
    return dense, SparseMatrix.read(ca.sparsify(ca.DM(dense)))


def test_operations_are_those_of_dense_matrices():
    dense, sparse = example()
    rng = np.random.default_rng(1)
    rows, columns = rng.uniform(size=6) < 0.6, rng.uniform(size=9) < 0.6
    factors = rng.uniform(1, 2, 6), rng.uniform(1, 2, 9)
    vectors = rng.standard_normal((9, 3))
    np.testing.assert_array_equal(sparse.write().full(), dense)
    np.testing.assert_array_equal(sparse.select(rows).write().full(), dense[rows])
    np.testing.assert_array_equal(sparse.select(rows, columns).write().full(), dense[rows][:, columns])
    np.testing.assert_allclose(sparse.scale(*factors).write().full(), factors[0][:, None] * dense * factors[1])
    np.testing.assert_array_equal(sparse.below_identity().write().full(), np.vstack([np.eye(9), dense]))
    np.testing.assert_allclose(sparse.times(vectors), dense @ vectors)
    np.testing.assert_allclose(sparse.times(vectors[:, 0]), dense @ vectors[:, 0])
    np.testing.assert_allclose(sparse.norms(), np.linalg.norm(dense, axis=1))
    np.testing.assert_array_equal(sparse.counts(), np.count_nonzero(dense, axis=1))


def test_a_product_with_no_column_is_empty():
    assert example()[1].times(np.empty((9, 0))).shape == (6, 0)


@pytest.mark.parametrize("most", [0, 50_000])
@pytest.mark.parametrize("repeated", [False, True])
def test_vectors_are_projected_onto_the_null_space(monkeypatch, most, repeated):
    """The first n unknowns of the solution are the projection, for dependent rows, too."""
    monkeypatch.setattr(sparse_matrix, "MANY_ENTRIES", most)
    dense = example(2)[0]
    dense = np.vstack([dense, dense[:2]]) if repeated else dense
    vectors = np.random.default_rng(3).standard_normal((9, 2))
    solve = factorise(SparseMatrix.read(ca.sparsify(ca.DM(dense))), 1e-12, corrections=2)
    projected = solve(np.vstack([vectors, np.zeros((len(dense), 2))]))[:9]
    np.testing.assert_allclose(projected, vectors - np.linalg.pinv(dense) @ dense @ vectors, atol=1e-9)
    np.testing.assert_allclose(dense @ projected, 0, atol=1e-9)


def test_a_vanishing_pivot_gives_no_output_and_a_finite_solution(capfd):
    """Two equal rows with a regularisation below rounding: the last pivot is exactly zero."""
    rows = SparseMatrix.read(ca.DM.ones(2, 4))
    vector = np.array([1.0, 2.0, 3.0, 6.0])
    solution = factorise(rows, 1e-17)(np.append(vector, [0.0, 0.0])[:, None])
    np.testing.assert_allclose(solution[:4, 0], vector - vector.mean())
    assert capfd.readouterr() == ("", "")
