"""A solve that fails is repeated from a coarser grid, and a plan that would fail its replay is refined."""

from dataclasses import replace

import pytest

from gaitopt import solve, verify
from gaitopt.ocp import Collocation
from gaitopt.ocp.multicontact import planar_refinement, planar_solver
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.status import Status
from tests.walkers.heel_toe import HEAVY, heel_toe_step


@pytest.fixture
def results(monkeypatch):
    """The result of each solve of a grid, in their order."""
    solves, solve_grid = [], planar_solver._Start.solve

    def record(start, *arguments, **options):
        solves.append(solve_grid(start, *arguments, **options))
        return solves[-1]

    monkeypatch.setattr(planar_solver._Start, "solve", record)
    return solves


def test_a_solve_that_fails_on_its_grid_starts_from_the_solution_on_half_as_many_intervals(results, monkeypatch):
    record = planar_solver._Start.solve

    def fail_first(start, *arguments, **options):
        result = record(start, *arguments, **options)
        return result if len(results) > 1 else fail(result)

    monkeypatch.setattr(planar_solver._Start, "solve", fail_first)
    gait = solve(heel_toe_step(0.05, intervals=8, build=HEAVY))
    assert [sum(result.problem.counts) for result in results] == [16, 8, 16]
    assert gait.status is Status.SOLVED
    assert gait.solver.objective == pytest.approx(results[0].outcome.objective, rel=1e-8)


def fail(result: GridResult) -> GridResult:
    """Return a result with the status of an infeasible problem."""
    return replace(result, outcome=replace(result.outcome, status=Status.INFEASIBLE))


@pytest.mark.slow  # 500 iterations of the first solve
def test_a_walker_whose_first_solve_ends_at_the_iteration_limit_is_solved():
    gait = verify(solve(heel_toe_step(0.2, intervals=12, build=HEAVY)))
    assert gait.verification.passed
    assert gait.solver.objective == pytest.approx(
        solve(heel_toe_step(0.15, intervals=12, build=HEAVY)).solver.objective, rel=1e-6
    )


def test_an_accurate_plan_that_would_fail_its_replay_is_refined():
    gait = verify(solve(heel_toe_step(0.05, intervals=6, build=HEAVY)))
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.state_error < 1e-7


def test_the_predicted_error_of_a_replay_is_that_of_the_simulator(results):
    gait = verify(
        solve(
            heel_toe_step(0.05, intervals=6, build=HEAVY).replace(
                transcription=Collocation(intervals=6, tolerance=1e-5)
            )
        )
    )
    assert len(results) == 1
    assert gait.verification.state_error > 1e-6
    assert results[0].replay_error == pytest.approx(gait.verification.state_error, rel=2e-3)


def test_a_plan_that_cannot_be_refined_names_the_magnification(monkeypatch):
    monkeypatch.setattr(planar_refinement, "MOST_FOR_REPLAY", 0)
    gait = solve(heel_toe_step(0.05, intervals=6, build=HEAVY))
    assert any("magnifies the error between nodes of 4.3e-08 by a factor of 7e+01" in w for w in gait.solver.warnings)
