"""The engine for many walks depends on the stiffness of the feedback, not on measured times."""

from importlib.util import find_spec
from pathlib import Path

import pytest

from gaitopt import load
from gaitopt.control import planar_joint_pd
from gaitopt.simulation.stiff_feedback import is_stiff, planar_engine_for_walks

FILE = Path(__file__).parents[2] / "docs/examples/heel_toe.h5"


@pytest.mark.parametrize(("damping", "stiff"), [(10.0, False), (1000.0, True)])
def test_feedback_is_stiff_if_a_period_takes_many_evaluations(damping, stiff):
    gait = load(FILE)
    law = planar_joint_pd(gait).with_gains({"motor_stiffness": 100.0, "motor_damping": damping})
    assert is_stiff(gait, law) is stiff
    fast = stiff and find_spec("heyoka") is not None
    assert planar_engine_for_walks(gait, law).name == ("heyoka" if fast else "scipy")


def test_a_package_that_is_missing_is_not_used(monkeypatch):
    monkeypatch.setattr("gaitopt.simulation.stiff_feedback.find_spec", lambda name: None)
    monkeypatch.setattr("gaitopt.simulation.stiff_feedback.STIFF", 1)
    gait = load(FILE)
    assert planar_engine_for_walks(gait, planar_joint_pd(gait)).name == "scipy"
