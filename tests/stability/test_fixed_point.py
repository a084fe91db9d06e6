"""Newton's method on return maps given as formulas."""

import dataclasses

import numpy as np
import pytest

from gaitopt.stability.fixed_point import FixedPointOptions, _stagnates, find_fixed_point
from gaitopt.stability.return_map import Passage


class Magnifying:
    """z -> 1 + M (z - 1), known to an absolute rounding of 3e-10 only."""

    matrix = np.diag([1e6, -0.5])

    def __call__(self, z):
        end = 1 + self.matrix @ (z - 1)
        return Passage(end + 3e-10 * np.sign(np.sin(1e13 * z)), (), ())

    def derivative(self, z, passage):
        return self.matrix


def test_a_fixed_point_is_as_exact_as_the_map_allows_where_it_magnifies():
    point = find_fixed_point(Magnifying(), np.array([1 + 1e-7, 1 + 1e-12]))
    assert point is not None
    assert point.residual > 1e-11  # no residual of such a map is smaller than its rounding
    assert point.z[0] == pytest.approx(1, abs=1e-14)


def test_a_residual_that_is_more_than_rounding_is_no_fixed_point():
    class Shifted(Magnifying):
        matrix = np.diag([0.5, -0.5])

    assert find_fixed_point(Shifted(), np.array([1.1, 1.1])) is None


def test_an_iteration_that_shrinks_to_zero_ends_early():
    class Standing:
        """z -> z / 2 with the wrong derivative 0, so that each iteration halves z, as near a walker that stands."""

        calls = 0

        def __call__(self, z):
            self.calls += 1
            return Passage(z / 2, (), ())

        def derivative(self, z, passage):
            return np.zeros((2, 2))

    standing, start = Standing(), np.array([0.3, -0.1])
    assert find_fixed_point(standing, start, FixedPointOptions(accept_zero=False)) is None
    assert standing.calls == 3
    assert find_fixed_point(standing, start, FixedPointOptions(max_iterations=40)).residual < 1e-11


class Sheared:
    """z -> z - M F(z) with a known fixed point at the origin: M amplifies one direction of the residual F a lot."""

    scales = np.diag([1.0, 300.0])

    def __call__(self, z):
        return Passage(z - self.scales @ self._residual(z), (), ())

    def derivative(self, z, passage):
        return np.eye(2) - self.scales @ np.array([[1.0, 0.0], [2 * z[0], 1.0]])

    @staticmethod
    def _residual(z):
        return np.array([z[0], z[1] + z[0] ** 2])


def test_a_step_that_reduces_the_newton_correction_is_accepted_although_the_residual_grows():
    # From (1, -1) the exact Newton step leads to (0, 1): the residual grows from 1 to 300, then the next step is exact.
    start = np.array([1.0, -1.0])
    options = FixedPointOptions(max_iterations=3, smallest_step=1)
    assert find_fixed_point(Sheared(), start, options) is None
    point = find_fixed_point(Sheared(), start, dataclasses.replace(options, compare_corrections=True))
    assert point is not None
    assert point.z == pytest.approx([0, 0], abs=1e-12)


def test_a_search_ends_early_if_neither_residual_nor_correction_reaches_a_new_minimum():
    assert not _stagnates([(1.0, 1.0), (2.0, 2.0), (2.0, 2.0)])
    assert _stagnates([(1.0, 1.0), (2.0, 2.0), (2.0, 2.0), (1.0, 1.5)])
    assert not _stagnates([(1.0, 1.0), (2.0, 2.0), (2.0, 2.0), (1.0, 0.9)])
