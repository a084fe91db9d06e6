"""The reference problem of the ocp tests and gaits solved once for all of them."""

import functools
import math

import pytest

from gaitopt import Collocation, GaitProblem, Limits, compass_biped, solve, verify

REFERENCE = {"sequence": "stick | stick", "friction": 0.14, "speed": 0.633, "step_length": 0.4713}


def _problem(*, intervals=40, torque=6.0, **changes):
    return GaitProblem(
        robot=compass_biped(),
        limits=changes.pop("limits", Limits(torque=torque)),
        transcription=changes.pop("transcription", Collocation(intervals=intervals)),
        **{**REFERENCE, **changes},
    )


@pytest.fixture(scope="session")
def reference_problem():
    """Return a maker of the reference problem (robot defaults, level ground) with some fields changed."""
    return _problem


@pytest.fixture(scope="session")
def solved():
    """Return a solver of reference problems that replays what it solves; each is solved once in a session."""

    @functools.cache
    def found(**changes):
        masses = changes.pop("masses", None)
        if masses is not None:
            changes["parameters"] = dict(zip(("leg_mass", "hip_mass"), masses, strict=True))
        gait = solve(_problem(**changes))
        return verify(gait) if gait.status.ok else gait

    return found


@pytest.fixture(scope="session")
def unlimited():
    """Friction of a foot that never slips."""
    return math.inf
