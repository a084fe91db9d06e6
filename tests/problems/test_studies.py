"""Every study script runs, reproduces its numbers and draws a labelled figure; here on small grids."""

import math
import runpy
from pathlib import Path

import pytest

from gaitopt.model import robot_named
from gaitopt.stability import cycle_iteration
from gaitopt.stability.cycle import make_cycle
from gaitopt.study import Reproduction

ROOT = Path(__file__).resolve().parents[2]
STUDIES = ROOT / "problems" / "studies"

SEQUENCES = ("stick | stick", "slip+ stick | slip+")
SMALL = {
    "benchmarks": {"starts": 30},
    "compass_actuated": {},
    "compass_branches": {"most": 0.19, "least": 0.165, "deflate": False},
    "compass_cascade": {"least": 4.3, "most": 4.5, "doublings": 0},
    "compass_force_ratio": {},
    "compass_multipliers": {"least": 0.1, "most": 0.2},
    "compass_portraits": {},
    "double_support": {"steps": (0.7, 0.8), "frictions": (0.4,), "workers": 1},
    "feedback_figures": {"laws": ("lqr",), "evaluations": 2, "starts": 1, "steps": 4, "pushes": 2},
    "feedback_laws": {"names": ("stick | stick",), "laws": ("lqr",), "evaluations": 2, "starts": 2, "sizes": 2},
    "frontier_ankle": {"limits": (6.0,), "speeds": (0.6, 0.6, 1), "workers": 1},
    "frontier_energy": {"frictions": (0.14,), "workers": 1},
    "frontier_friction": {"least": 0.14, "most": 0.14, "step": 0.04, "sequences": SEQUENCES, "workers": 1},
    "frontier_speed_step": {"speeds": (0.633, 0.633, 1), "steps": (0.4713, 0.4713, 1), "workers": 1},
    "imitation_cost": {"frictions": (0.14,)},
    "rimless_basin_friction": {"frictions": 5, "rates": 4, "workers": 1},
    "rimless_basin_slope": {"slopes": 5, "rates": 4, "workers": 1},
    "rimless_branches": {},
    "rimless_cascade": {"steps": 40},
    "rimless_force_ratio": {},
    "rimless_lift_off": {"samples": 3},
    "rimless_portraits": {"steps": 2},
    "rimless_regions": {"spokes": (5, 10), "points": 11, "checked": (0.5,)},
    "rimless_types": {"slopes": ((13.0, ("C and D",)),), "least": 12.4, "most": 13.005, "frictions": (0.24, 0.22)},
    "multi_step_gaits": {},
    "robust_gait": {"count": 2, "evaluations": 2},
    "trade_off_torque": {"points": 2},
    "slipping_landings": {"hopping": (0.2, 0.7), "running": (), "workers": 2},
}
"""Parameters that make each script quick."""

FINDINGS = {
    "double_support": {
        "At friction 0.4 double support costs less at steps of 0.8 m.",
        "6 of 6 gaits were found and passed the replay.",
    },
    "slipping_landings": {
        "Monopod, hopping: the slipping landing costs less at friction 0.2.",
        "Monopod, hopping: 4 of 4 gaits were found and passed the replay.",
    },
}
"""Remarks on these small grids."""

STORED = {"double_support": 3, "slipping_landings": 2}
"""Number of sweeps that a study stores in a folder."""

EXPLAINED = {
    "rimless_branches": {
        "Type B, slip+ stick slip+ | stick: least friction",
        "Type C: greatest friction",
        "Type C: least friction, rounded",
        "Type D: least friction",
    }
}
"""Published numbers that do not come out; the remarks of the study state this."""


@pytest.fixture(autouse=True)
def neighbours(monkeypatch):
    """Let the scripts import the modules beside them."""
    monkeypatch.syspath_prepend(str(STUDIES))


@pytest.fixture
def gaits(monkeypatch):
    """Collect every periodic gait that is found."""
    found = []

    def keep(*arguments):
        found.append(make_cycle(*arguments))
        return found[-1]

    monkeypatch.setattr(cycle_iteration, "make_cycle", keep)
    return found


def run(name, **parameters):
    return runpy.run_path(str(STUDIES / f"{name}.py"))["study"](**parameters)


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_study_reproduces_its_numbers_in_a_labelled_figure(name, gaits, tmp_path):
    study = run(name, **SMALL[name], **({"folder": tmp_path} if name in STORED else {}))
    assert len(list(tmp_path.glob("*.nc"))) == STORED.get(name, 0)
    assert isinstance(study, Reproduction)
    assert all(type(number.agrees) is bool for number in study.numbers)
    assert {number.name for number in study.numbers if not number.agrees} == EXPLAINED.get(name, set())
    assert study.numbers
    assert name not in EXPLAINED or study.remarks
    assert FINDINGS.get(name, set()) <= set(study.remarks)
    axes = study.figure.axes
    assert all(any(one.get_xlabel() for one in side) for side in _lowest(axes))
    assert any(one.get_ylabel() for one in axes)
    for gait in gaits:
        assert_lost_is_what_gravity_gives(gait)


def assert_lost_is_what_gravity_gives(gait):
    """A gait loses what motors and gravity give, m g L sin(slope), to impacts and friction; L includes the slide."""
    robot, given = robot_named(gait.robot), gait.parameters
    mass = float(robot.mass(robot.vector(given)))
    given_by_gravity = mass * given["gravity"] * gait.travel * math.sin(given["slope"])
    lost = gait.energy.impact_loss + gait.energy.friction_loss + gait.energy.kinetic_change
    assert lost == pytest.approx(given_by_gravity + gait.energy.actuator, rel=1e-9)
    if not gait.drift:
        assert gait.energy.kinetic_change == pytest.approx(0, abs=1e-9 * lost)


def _lowest(axes):
    """Return the panels of each column, from left to right."""
    columns = {}
    for one in (one for one in axes if one.get_subplotspec() is not None):  # the others are colour bars
        columns.setdefault(one.get_subplotspec().colspan.start, []).append(one)
    return columns.values()


def test_every_study_is_tested_and_on_the_page():
    scripts = {path.stem for path in STUDIES.glob("*.py") if "\ndef study(" in path.read_text(encoding="utf-8")}
    assert scripts == set(SMALL)
    pages = [
        ROOT / "docs" / name
        for name in (
            "reproduction.md",
            "frontiers.md",
            "slipping_contacts.md",
            "howto/design.md",
            "howto/multi_step.md",
        )
    ]
    page = "".join(path.read_text(encoding="utf-8") for path in pages)
    assert all(
        f"images/study_{name}.png" in page and (ROOT / "docs" / "images" / f"study_{name}.png").is_file()
        for name in scripts
    )


def test_every_study_says_what_it_shows_and_has_defaults():
    for path in STUDIES.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert text.startswith('"""')
        assert "\ndef study(" not in text or text.rstrip().endswith("run_study(__file__)")
