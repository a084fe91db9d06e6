"""Gains under which anything is nan are the worst, never the best."""

import math

import numpy as np
import pytest

from gaitopt import GainSearchOptions, SensitivityNorm, SpectralRadius, compass_biped
from gaitopt.progress import silent
from gaitopt.tuning import controller_family_named, ground_map
from gaitopt.tuning.gain_search import INFEASIBLE_PENALTY, GainSearch


@pytest.mark.parametrize("objective", [SpectralRadius(), SensitivityNorm()])
@pytest.mark.parametrize("entry", [np.nan, np.inf])
def test_a_derivative_that_is_not_finite_is_unstable(objective, entry):
    assert objective(np.array([[0.5, entry], [0.0, 0.2]]), np.ones(2)) == math.inf


@pytest.fixture
def search(slipping):
    robot = compass_biped()
    design = controller_family_named("pd", robot, slipping.motion, torque_limit=8)
    return GainSearch(slipping, robot, design, SpectralRadius(), (0.15,), None, silent)


@pytest.mark.parametrize("values", [(math.nan, 0.5, 0.7), (0.5, math.nan, 0.7), (0.7, 0.5, math.nan)])
def test_a_trial_that_is_nan_is_not_the_best(search, monkeypatch, values):
    values = iter([*values, *[0.9] * 100])
    monkeypatch.setattr(search, "_value", lambda gains: next(values))
    assert search.search(GainSearchOptions(samples=2, starts=1, evaluations=3)).objective == 0.5


@pytest.mark.parametrize("values", [(math.nan, 0.5), (0.5, math.nan)])
def test_the_worst_ground_is_that_with_nan(search, monkeypatch, values):
    monkeypatch.setattr(search, "_on_ground", lambda law, ground: values[search._grounds.index(ground)])
    assert search._value({gain.name: gain.start for gain in search.family.gains}) == math.inf


def test_a_return_map_that_is_nan_is_hopeless(search, monkeypatch):
    monkeypatch.setattr(ground_map.ReturnMap, "derivative", lambda self, z, passage: np.full((6, 6), np.nan))
    monkeypatch.setattr(ground_map, "one_sided_derivatives", lambda *_: ())
    assert search._value({gain.name: gain.start for gain in search.family.gains}) == INFEASIBLE_PENALTY
