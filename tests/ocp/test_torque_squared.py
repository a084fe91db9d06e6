"""The smooth objective converges to the optimum of the continuous problem."""

import math

import numpy as np
import pytest

from gaitopt import Ipopt, MultipleShooting, Newton, Status, TorqueSquared, solve
from gaitopt.ocp import PlanarLimits
from tests.ocp.multicontact_examples import hop
from tests.references.storage import reference

# Optimal integral of the squared torques, 100 kg in all (legs 40 kg, hip 20 kg), level ground, 0.633 m/s, 0.4713 m,
# friction and torques unlimited: tests/references/compass_optimum.py, which uses nothing of gaitopt.
CONTINUOUS = reference("compass_optimum", "torque_squared")["objective"]
UNLIMITED = {"masses": (40.0, 20.0), "torque": math.inf, "friction": math.inf, "objective": "torque_squared"}


@pytest.fixture(scope="module")
def values(solved):
    return {
        n: solved(**UNLIMITED, transcription=MultipleShooting(intervals=n)).solver.objective for n in (10, 20, 40, 80)
    }


def test_the_continuous_value_is_reached(values):
    assert values[80] == pytest.approx(CONTINUOUS, rel=5e-7)
    assert values[20] == pytest.approx(CONTINUOUS, rel=1e-6)


def test_it_converges_from_above(values):
    """Torques linear between nodes are a subset of all torques, so a finer grid can only gain."""
    assert values[10] > values[20] > values[40] > values[80]
    gains = np.diff(list(values.values()))
    assert np.all(gains[1:] / gains[:-1] < 1 / 8)


def test_the_objective_is_the_integral_of_the_planned_torques(solved):
    gait = solved(**UNLIMITED, transcription=MultipleShooting(intervals=20))
    segment = gait.motion.segments[0]
    start, middle, end = segment.torque[:, :-1:2], segment.torque[:, 1::2], segment.torque[:, 2::2]
    step = segment.duration / 20
    assert middle == pytest.approx((start + end) / 2)  # linear between nodes
    integral = step / 6 * np.sum(start**2 + 4 * middle**2 + end**2)
    assert integral == pytest.approx(gait.solver.objective, rel=1e-9)
    assert gait.problem["objective"] == TorqueSquared.name
    assert gait.verification.passed


def test_coarse_grids_need_no_newton_steps(reference_problem, monkeypatch):
    """The coarse optimum of a smooth objective is only a start, found by Ipopt with a large tolerance."""
    solves, interior, newton = [], Ipopt.minimise, Newton.minimise

    def by_ipopt(solver, *given):
        solves.append(solver.tolerance)
        return interior(solver, *given)

    def by_newton(solver, *given, **options):
        solves.append("Newton")
        return newton(solver, *given, **options)

    monkeypatch.setattr(Ipopt, "minimise", by_ipopt)
    monkeypatch.setattr(Newton, "minimise", by_newton)
    assert solve(reference_problem(objective="torque_squared", friction=0.2)).status is Status.SOLVED
    assert solves[:2] == [1e-6, "Newton"]


@pytest.mark.parametrize(
    ("limits", "unit"),
    [
        ({}, "N^2 m^2 s + N^2 s"),
        ({"leg": 0}, "N^2 m^2 s"),
        ({"hip": 0}, "N^2 s"),
    ],
)
def test_squares_of_torques_and_forces_are_added_in_si_units(limits, unit):
    problem = hop().replace(objective="torque_squared", limits=PlanarLimits(torque=limits))
    assert problem.describe()["objective_unit"] == unit
    assert problem.replace(objective="cost_of_transport").describe()["objective_unit"] == "1"
