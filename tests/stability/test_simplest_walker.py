"""The simplest walker as the limit of light legs, against its published multipliers."""

import itertools

import numpy as np
import pytest

from gaitopt import compass_biped
from tests.references.storage import MULTIPLIER_ACCURACY, complex_numbers, reference

RATIOS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)


def extrapolate(values):
    """Return the limit for ratio -> 0 by Richardson's scheme for a halved parameter and a smooth dependence."""
    table = [np.asarray(v) for v in values]
    for order in range(1, len(table)):
        table = [(2**order * b - a) / (2**order - 1) for a, b in itertools.pairwise(table)]
    return table[0]


def test_simplest_walker(cycle):
    # Garcia et al.'s walker at slope 0.009 in units of leg length and gravity; all digits by a computation
    # with massless legs; tests/references/simplest_walker.py repeats it with fewer digits.
    states, multipliers = [], []
    for ratio in RATIOS:
        parameters = {"leg_length": 1, "leg_com": 0, "hip_mass": 1, "gravity": 1, "leg_mass": ratio, "slope": 0.009}
        gait = cycle(compass_biped(), parameters, [-0.2003, 0.1998, -0.184, 0])
        states.append(gait.z[:2])
        multipliers.append(sorted(gait.multipliers, key=lambda m: m.imag))
    state, limit = extrapolate(states), extrapolate(multipliers)
    assert state == pytest.approx([-0.2003109005442, 0.1998324730050], abs=1e-9)
    assert limit[2] == pytest.approx(-0.1900998410659 + 0.5575987766821j, abs=1e-9)
    assert limit[1] == pytest.approx(0, abs=1e-9)
    stored = reference("simplest_walker", "long_period")
    assert state == pytest.approx(stored["z"], abs=1e-9)
    assert [limit[0], limit[2]] == pytest.approx(complex_numbers(stored["multipliers"]), abs=MULTIPLIER_ACCURACY)
