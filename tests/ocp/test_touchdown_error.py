"""Errors of a plan grow until after the touchdown: the check of the plan predicts the error of its replay."""

import math

import pytest

from gaitopt import Collocation, Limits, MultipleShooting, Newton, Status, solve, verify
from gaitopt.ocp.solution import grid_solve, trajectory
from gaitopt.ocp.solution.diagnosis import LARGEST_GROWTH
from gaitopt.ocp.solution.grid_solve import BARRIER_SAME_PROBLEM, GridSolution, SingleStart
from gaitopt.ocp.solution.trajectory import BetweenNodes
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.progress import silent

SLIP = "slip+ stick | slip+"


def record_checks(monkeypatch):
    """Return the list that collects the arguments and results of the checks of plans."""
    checks, check = [], trajectory.check_between_nodes

    def record(*arguments):
        checks.append((arguments, check(*arguments)))
        return checks[-1][1]

    monkeypatch.setattr(grid_solve, "check_between_nodes", record)
    return checks


@pytest.mark.parametrize(
    ("sequence", "coarse"),
    [
        ("stick | stick", MultipleShooting(intervals=6, tolerance=0.1)),
        (SLIP, Collocation(intervals=4, points=3, tolerance=0.1)),
        (SLIP, MultipleShooting(intervals=6, tolerance=0.1)),
    ],
)
def test_the_check_predicts_the_error_of_the_replay(reference_problem, monkeypatch, sequence, coarse):
    checks = record_checks(monkeypatch)
    limits = Limits(torque=10.0)
    problem = reference_problem(sequence=sequence, limits=limits, transcription=coarse, objective="torque_squared")
    gait = verify(solve(problem, starts=1))
    between = checks[-1][1]
    assert gait.verification.state_error > 1e-6
    assert between.touchdown == pytest.approx(gait.verification.state_error, rel=0.05)


def test_the_growth_of_errors_is_that_of_deviating_plans(reference_problem, monkeypatch):
    checks = record_checks(monkeypatch)
    problem = reference_problem(sequence=SLIP, limits=Limits(torque=10.0), objective="torque_squared")
    assert solve(problem, starts=1).status is Status.SOLVED
    arguments = checks[-1][0]
    growth = trajectory.estimate_growth(*arguments)
    assert 1 < growth < 1e4
    assert trajectory.check_between_nodes(*arguments, 1e-7).touchdown == pytest.approx(1e-7 * growth, rel=0.01)


@pytest.mark.parametrize(
    ("tolerance", "after", "status"),
    [
        (1e-7, 0.9e-6, Status.SOLVED),
        (1e-7, 1.1e-6, Status.PLAN_INACCURATE),
        (1e-6, 0.9e-6, Status.SOLVED),
        (1e-6, 1.1e-6, Status.PLAN_INACCURATE),
        (math.inf, 1.0, Status.SOLVED),
    ],
)
def test_an_error_that_a_replay_does_not_allow_is_inaccurate(reference_problem, monkeypatch, tolerance, after, status):
    monkeypatch.setattr(GridSolution, "between", BetweenNodes(drift=0.0, outside=0.0, touchdown=after))
    method = Collocation(intervals=20, tolerance=tolerance)
    start = SingleStart(reference_problem(transcription=method), LinearGuess(), Newton(), silent)
    assert start.solve_on_grid(method, None, BARRIER_SAME_PROBLEM).check_plan().outcome.status is status


def test_a_plan_whose_rounding_errors_grow_too_much_is_inaccurate(reference_problem, monkeypatch):
    monkeypatch.setattr(grid_solve, "estimate_growth", lambda *arguments: 2 * LARGEST_GROWTH)
    monkeypatch.setattr(grid_solve, "EXACT", 0.0)
    method = Collocation(intervals=20)
    start = SingleStart(reference_problem(transcription=method), LinearGuess(), Newton(), silent)
    solution = start.solve_on_grid(method, None, BARRIER_SAME_PROBLEM).check_plan()
    assert solution.outcome.status is Status.PLAN_INACCURATE
    assert "6.0e+07 times as large after the touchdown" in solution.inaccuracies[0]
