"""Gaits in which a contact slips by choice cost less than those in which it sticks, and pass their replay."""

import runpy
from pathlib import Path

import pytest

STUDIES = Path(__file__).resolve().parents[2] / "problems" / "studies"


@pytest.fixture(autouse=True)
def neighbours(monkeypatch):
    """Let the scripts import the modules beside them."""
    monkeypatch.syspath_prepend(str(STUDIES))


def remarks(name, **parameters):
    return runpy.run_path(str(STUDIES / f"{name}.py"))["study"](**parameters).remarks


def test_double_support_with_a_slipping_foot_costs_less_at_long_steps_only():
    """At friction 0.4, the costs of the gaits cross between steps of 0.7 and 0.8 m."""
    lines = remarks("double_support", steps=(0.7, 0.8), frictions=(0.4,))
    assert "At friction 0.4 double support costs less at steps of 0.8 m." in lines
    assert "6 of 6 gaits were found and passed the replay." in lines


def test_a_landing_that_slips_costs_less_at_low_friction_only():
    lines = remarks("slipping_landings", hopping=(0.2, 0.7), running=())
    assert "Monopod, hopping: the slipping landing costs less at friction 0.2." in lines
    assert "Monopod, hopping: 4 of 4 gaits were found and passed the replay." in lines
