"""Grids of planar robots refined for the objective: solves on the same grids, and what is stated if none suffices."""

from types import SimpleNamespace

import pytest

from gaitopt import Collocation, InputError, Status, load, save, solve
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from gaitopt.ocp import PlanarLimits, PlanarProblem
from gaitopt.ocp.multicontact import planar_refinement
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait

INTERVALS, TOLERANCE = 4, 0.01


def make_problem(cost_tolerance=None, intervals=INTERVALS, guess=None):
    """Return the compass with two feet, which walks with hip torque only."""
    problem = PlanarProblem(
        robot=compass_with_two_feet(),
        sequence="foot A stick |",
        friction=1.0,
        speed=0.633,
        step_length=0.4713,
        objective="torque_squared",
        limits=PlanarLimits(torque={"ankle B": 0}),
        transcription=Collocation(intervals=intervals, cost_tolerance=cost_tolerance),
    )
    return problem if guess is None else problem.replace(guess=guess)


@pytest.fixture(scope="module")
def plain():
    """Return the gait on the stated grid."""
    return solve(make_problem())


@pytest.fixture(scope="module")
def refined():
    """Return the gait whose objective changes by at most the tolerance if its grid is refined."""
    return solve(make_problem(TOLERANCE))


def test_the_error_of_the_objective_is_the_difference_from_a_solve_on_half_as_many_intervals(plain, refined):
    (count,) = refined.problem["intervals"]
    half = solve(make_problem(intervals=count // 2, guess=FromPlanarGait(plain)))
    assert count > INTERVALS
    assert 0 < refined.solver.cost_error <= TOLERANCE
    expected = abs(half.solver.objective / refined.solver.objective - 1)
    assert refined.solver.cost_error == pytest.approx(expected, rel=1e-3)
    assert not refined.solver.warnings


def test_the_table_states_the_intervals_before_the_refinement(plain, refined):
    (count,) = refined.problem["intervals"]
    grids = [dict(tabulate_planar_gait(gait))["grid"] for gait in (refined, plain)]
    assert grids[0].startswith(f"{count} intervals (refined from {INTERVALS}), error between nodes")
    assert grids[1].startswith(f"{INTERVALS} intervals, error")


def test_a_finer_grid_has_a_lower_objective_near_that_on_many_intervals(plain, refined):
    fine = solve(make_problem(intervals=64, guess=FromPlanarGait(plain)))
    assert fine.solver.objective < refined.solver.objective < plain.solver.objective
    assert refined.solver.objective / fine.solver.objective - 1 < refined.solver.cost_error


def test_the_stated_grid_is_kept_without_a_tolerance_of_the_objective(plain):
    assert plain.problem["intervals"] == [INTERVALS]
    assert "cost_tolerance" not in plain.problem


def test_unequal_intervals_are_refused():
    with pytest.raises(InputError, match="phases have equal intervals"):
        make_problem().replace(transcription=Collocation(intervals=2, fractions=((0.0, 0.3, 1.0),)))


def test_a_tolerance_that_no_grid_meets_is_stated(monkeypatch):
    monkeypatch.setattr(planar_refinement, "MOST_FOR_COST", 1)
    gait = solve(make_problem(1e-9))
    (warning,) = gait.solver.warnings
    assert gait.status is Status.SOLVED
    assert "the objective on 8 intervals differs by" in warning
    assert "(cost_tolerance 1e-07 %): the refinement has ended" in warning


def test_a_failed_solve_on_a_finer_grid_is_stated_and_the_gait_is_kept(plain, monkeypatch):
    monkeypatch.setattr(planar_refinement, "_is_accurate", lambda result: False)
    gait = solve(make_problem(TOLERANCE))
    (warning,) = gait.solver.warnings
    assert gait.solver.objective == pytest.approx(plain.solver.objective, rel=1e-9)
    assert f"the objective on {INTERVALS} intervals is not compared with a finer grid" in warning
    assert f"the solve on {2 * INTERVALS} intervals failed" in warning


class CostlyFirstGrid:
    """Stands for a start whose finer grids have the objectives 1, 1.05 and 1.05."""

    def __init__(self):
        self.objectives = [1.0, 1.05, 1.05]

    def solve_on_finer_grid(self, result, method, *, from_below):
        """Return the next result."""
        return make_result(self.objectives.pop(0), method.intervals)


def make_result(objective, intervals):
    """Return a result that has an objective alone."""
    outcome = SimpleNamespace(status=Status.SOLVED, objective=objective)
    return GridResult(make_problem(TOLERANCE, intervals), None, None, outcome)


def test_the_gait_of_lowest_cost_is_returned_and_a_costlier_local_optimum_on_a_finer_grid_is_stated(monkeypatch):
    monkeypatch.setattr(planar_refinement, "_is_accurate", lambda result: True)
    best = planar_refinement._refine_for_cost(CostlyFirstGrid(), make_result(2.0, INTERVALS))
    assert (best.outcome.objective, best.problem.counts) == (1.0, (2 * INTERVALS,))
    assert best.cost_error == pytest.approx(0.05)
    assert best.cost_ending == "the solve on a finer grid converged to a local optimum of higher cost"


def test_the_error_of_the_objective_is_stored_and_listed(refined, tmp_path):
    save(refined, tmp_path / "gait.h5")
    gait = load(tmp_path / "gait.h5")
    assert gait.solver.cost_error == refined.solver.cost_error
    assert gait.problem["cost_tolerance"] == TOLERANCE
    text = dict(tabulate_planar_gait(gait))["grid"]
    assert f"; doubling the intervals changes the objective by {100 * gait.solver.cost_error:.1g} %" in text
