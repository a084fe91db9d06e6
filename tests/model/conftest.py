"""Parameter sets and random states for the models."""

import numpy as np
import pytest

from tests.newton_euler.compass import HandCompass

COMPASSES = {
    "Gamus & Or": HandCompass(slope=np.deg2rad(1), mu=0.14),
    "Goswami": HandCompass(length=1.0, com=0.5, mass=5.0, hip=10.0, gravity=9.81, slope=np.deg2rad(3), mu=0.6),
    "feet only": HandCompass(length=0.7, com=0.0, mass=0.3, hip=4.0, gravity=1.6, slope=-0.2, mu=1.3),
    "no hip": HandCompass(length=1.1, com=0.9, mass=2.0, hip=0.0, gravity=9.8, slope=0.0, mu=0.0),
}


@pytest.fixture(params=COMPASSES.values(), ids=COMPASSES.keys())
def hand(request):
    """Return the same compass written by hand."""
    return request.param


@pytest.fixture
def states(rng):
    """Return random (q, v, u) of the compass, the foot free to slide along the ground."""
    return [
        (
            np.concatenate([rng.normal(size=2), rng.uniform(-0.6, 0.6, size=2)]),
            np.concatenate([rng.normal(size=1), [0.0], rng.normal(size=2)]),
            rng.normal(size=2) * 3,
        )
        for _ in range(25)
    ]
