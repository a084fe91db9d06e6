"""Robots and the example gait, shared by all tests."""

from pathlib import Path

import numpy as np
import pytest

from gaitopt import compass_biped, load, rimless_wheel

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def compass():
    return compass_biped()


@pytest.fixture(scope="session")
def wheel():
    return rimless_wheel()


@pytest.fixture(scope="session")
def slip_gait():
    """Return the example: an optimised gait 'slip+ stick | slip+' on level ground at friction 0.14."""
    return load(ROOT / "docs" / "examples" / "compass_slip.h5")


@pytest.fixture
def rng():
    return np.random.default_rng(20150801)
