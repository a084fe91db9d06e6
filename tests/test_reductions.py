"""Reductions never lose a nan."""

import itertools
import math

import numpy as np
import pytest

from gaitopt.reductions import rank_of, worst

NAN = math.nan


@pytest.mark.parametrize("values", list(itertools.permutations([0.0, NAN, 2.0])))
def test_a_nan_is_the_worst_wherever_it_stands(values):
    assert worst(*values) == math.inf
    assert worst(np.array(values)) == math.inf
    assert worst(1.0, np.array(values)) == math.inf
    assert sorted(values, key=rank_of)[:2] == [0.0, 2.0]


def test_the_largest_of_numbers_and_arrays():
    assert worst(0.0, [1.0, 3.0], np.zeros((0, 2)), -1) == 3.0
    assert worst() == -math.inf
    assert rank_of(-2) == -2.0
