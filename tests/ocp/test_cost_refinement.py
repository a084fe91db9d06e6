"""Grids refined for the cost: the estimate against finer grids, and what is returned when a finer grid fails."""

import dataclasses
import json
import math

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, Status, WarmStart, compass_biped, load, save, solve
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.summary import summarise
from gaitopt.ocp.initial.cost_prediction import predict_cost
from gaitopt.ocp.solution import cost_refinement
from gaitopt.ocp.solution.cost_error import GridCost, estimate_factor
from gaitopt.ocp.solution.grid_solve import GridSolution, SingleStart
from gaitopt.ocp.solution.node_placement import allot_intervals, distribute_nodes, find_ramps, make_ramps
from tests.benchmarks.random_problems import BEST_KNOWN, draw_problem
from tests.benchmarks.random_problems_page import is_right

SLIP = "slip+ stick | slip+"
TOLERANCE = 0.003
EXACT = 0.0015
"""A tolerance that 40 equal intervals of the first random problem do not meet."""


@pytest.fixture(scope="module")
def refined(reference_problem):
    """Return default gaits by contact sequence; each is solved once."""
    return {
        sequence: solve(reference_problem(sequence=sequence, transcription=Collocation()))
        for sequence in ("stick | stick", SLIP)
    }


def on_finer_grid(problem, gait, total):
    """Return the gait on `total` intervals placed by its torques, warm-started from it."""
    ramps = find_ramps(gait.solution)
    counts = allot_intervals(ramps, total)
    method = Collocation(intervals=counts, fractions=distribute_nodes(ramps, counts))
    return solve(problem.replace(transcription=method, guess=WarmStart(gait)))


def random_problem(seed):
    """Return a problem of random size and planet, whose torques switch between their limits and zero."""
    rng, slips = np.random.default_rng(5000 + seed), seed % 2 == 1
    length, gravity = rng.uniform(0.5, 2.0), float(rng.choice([3.7, 9.81]))
    leg_mass, hip_mass = rng.uniform(0.5, 8.0), rng.uniform(0.5, 12.0)
    weight = (2 * leg_mass + hip_mass) * gravity
    body = {"leg_length": length, "leg_com": length * rng.uniform(0.35, 0.7), "leg_mass": leg_mass}
    return GaitProblem(
        robot=compass_biped(),
        sequence=SLIP if slips else "stick | stick",
        parameters={**body, "hip_mass": hip_mass, "gravity": gravity},
        friction=float(rng.uniform(0.1, 0.2) if slips else rng.uniform(0.12, 0.5)),
        slope=0.0 if rng.random() < 0.6 else float(rng.uniform(0, 0.03)),
        speed=float(rng.uniform(0.1, 0.25) * np.sqrt(gravity * length)),
        step_length=float(length * rng.uniform(0.2, 0.45)),
        limits=Limits(torque=float(weight * length * rng.uniform(0.04, 0.2))),
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 7])
def test_the_default_grid_is_accurate_in_cost(seed):
    """Truth: the same local optimum on about twice as many intervals as the finest of the solve."""
    problem = random_problem(seed)
    gait, fixed = solve(problem), solve(problem.replace(transcription=Collocation(intervals=40)))
    truth = on_finer_grid(problem, gait, 160).solver.objective
    error, error_of_fixed = (one.solver.objective / truth - 1 for one in (gait, fixed))
    assert 0 < error < TOLERANCE < error_of_fixed
    assert gait.solver.cost_error < TOLERANCE < fixed.solver.cost_error
    assert error / 3 < gait.solver.cost_error < 3 * error
    assert error_of_fixed / 4 < fixed.solver.cost_error < 4 * error_of_fixed


def test_a_stated_number_of_intervals_is_kept(reference_problem):
    fixed, coarse = (solve(reference_problem(intervals=count)) for count in (40, 20))
    assert (fixed.problem["intervals"], fixed.solution.fractions) == ([40], None)
    assert fixed.problem["cost_tolerance"] == math.inf
    assert 0 < fixed.solver.cost_error < 0.1
    assert math.isnan(coarse.solver.cost_error)  # there is no other grid to compare with


@pytest.fixture
def demanding():
    """Return a problem whose first grid does not meet its tolerance."""
    return random_problem(0).replace(transcription=Collocation(intervals=40, cost_tolerance=EXACT))


def test_a_stated_tolerance_refines_a_stated_grid(demanding):
    gait, fixed = solve(demanding), solve(demanding.replace(transcription=Collocation(intervals=40)))
    assert fixed.solver.cost_error > EXACT >= gait.solver.cost_error
    assert gait.solution.fractions is not None
    assert gait.solver.objective < (1 - EXACT) * fixed.solver.objective


def test_an_infinite_tolerance_keeps_the_default_grid(reference_problem):
    gait = solve(reference_problem(transcription=Collocation(cost_tolerance=math.inf)))
    assert (gait.problem["intervals"], gait.solution.fractions) == ([40], None)


def test_a_failure_on_a_finer_grid_returns_the_coarser_result(demanding, monkeypatch):
    solve_on_grid = SingleStart.solve_on_grid

    def fail(start, method, *arguments, **options):
        solution = solve_on_grid(start, method, *arguments, **options)
        if method.fractions is None:
            return solution
        return dataclasses.replace(solution, outcome=dataclasses.replace(solution.outcome, status=Status.INFEASIBLE))

    monkeypatch.setattr(SingleStart, "solve_on_grid", fail)
    gait = solve(demanding)
    assert gait.status is Status.SOLVED
    assert (gait.problem["intervals"], gait.solution.fractions) == ([40], None)
    (warning,) = gait.solver.warnings
    assert "may exceed its value on a finer grid by" in warning
    assert "the solve on a finer grid failed" in warning


def test_an_inaccurate_plan_on_a_finer_grid_returns_the_coarser_result(demanding, monkeypatch):
    check_plan = GridSolution.check_plan

    def check(solution):
        if solution.method.fractions is None:
            return check_plan(solution)
        return dataclasses.replace(
            solution, outcome=dataclasses.replace(solution.outcome, status=Status.PLAN_INACCURATE)
        )

    monkeypatch.setattr(GridSolution, "check_plan", check)
    gait = solve(demanding)
    assert gait.status is Status.SOLVED
    assert gait.solution.fractions is None
    assert "the solve on a finer grid failed" in gait.solver.warnings[-1]


def test_a_refinement_that_ends_above_its_tolerance_is_reported(demanding, monkeypatch):
    monkeypatch.setattr(cost_refinement, "GROWTH", ())
    gait = solve(demanding)
    assert gait.status is Status.SOLVED
    assert "(cost_tolerance 0.15 %): the refinement has ended." in gait.solver.warnings[-1]


def test_a_warm_start_keeps_the_nodes(reference_problem, refined):
    """Only the numbers of the NLP differ, so it is not built again; the estimate is that of the known gait, scaled."""
    gait = refined["stick | stick"]
    problem = reference_problem(friction=0.141, transcription=Collocation(), guess=WarmStart(gait))
    near = solve(problem)
    assert near.status is Status.SOLVED
    assert near.solution.fractions == gait.solution.fractions
    assert near.solver.build_seconds == 0
    assert near.solver.cost_error == pytest.approx(gait.solver.cost_error, rel=1.0)


def test_the_cost_on_a_refined_grid_is_predicted(reference_problem, refined):
    problem = reference_problem(transcription=Collocation(), objective="torque_squared")
    gait = solve(problem)
    assert gait.solution.fractions is not None
    assert predict_cost(problem, gait) == pytest.approx(gait.solver.objective, rel=1e-7)


def test_the_estimate_is_reported_and_saved(refined, tmp_path):
    gait = refined[SLIP]
    (row,) = [text for name, text in tabulate_gait(gait) if name == "grid"]
    assert row.startswith(f"{sum(gait.problem['intervals'])} intervals, objective within 0.")
    summary = json.loads(json.dumps(summarise(gait)))
    assert summary["solver"]["cost_error"] == gait.solver.cost_error
    assert summary["problem"]["cost_tolerance"] == TOLERANCE
    save(gait, tmp_path / "gait.h5")
    read = load(tmp_path / "gait.h5")
    assert read.solver.cost_error == gait.solver.cost_error
    assert read.solution.fractions == gait.solution.fractions
    assert read.solution.cost_factor == gait.solution.cost_factor


def test_a_file_of_an_earlier_version_has_no_estimate():
    gait = load("docs/examples/compass_slip.h5")
    assert math.isnan(gait.solver.cost_error)
    assert gait.solution.fractions is None
    assert "grid" not in dict(tabulate_gait(gait))


def test_the_factor_of_the_error():
    """The objective is 1 + 2 times the variation; grids of about the same variation have no influence."""
    last = GridCost(1.2, 0.1)
    assert estimate_factor([GridCost(3.0, 1.0)], last) == pytest.approx(2.0)
    assert estimate_factor([GridCost(3.0, 1.0), GridCost(1.4, 0.11), last], last) == pytest.approx(2.0)
    assert math.isnan(estimate_factor([last], last))


def test_stated_fractions_are_kept(reference_problem):
    nodes = ((0.0, *(np.linspace(0, 1, 41)[1:-1] ** 1.2).tolist(), 1.0),)
    gait = solve(reference_problem(objective="torque_squared", transcription=Collocation(fractions=nodes)))
    assert gait.solution.fractions == nodes


def test_a_finer_grid_determines_the_factor():
    """Grids of lower variation than the last one exist if a coarser one has a lower cost, or an accurate plan."""
    last = GridCost(1.2, 0.1)
    assert estimate_factor([GridCost(3.0, 1.0), GridCost(1.11, 0.01)], last) == pytest.approx(1.0)


def test_the_error_is_the_mean_square_of_two_measures():
    """From 2 to 1.1 the variation falls from 1 to 0.01, which leaves 0.9 / 99, and with double ramps to 0.1: 0.1."""
    last = GridCost(1.1, 0.01, 0.1)
    both = math.sqrt((0.1**2 + (0.9 / 99) ** 2) / 2)
    assert estimate_factor([GridCost(2.0, 1.0, 1.0)], last) * last.variation == pytest.approx(both)
    assert estimate_factor([GridCost(2.0, 1.0)], last) * last.variation == pytest.approx(0.9 / 99)


def test_the_variation_of_a_jump_over_two_intervals():
    """Twelve times the jump times the variance of the time along the ramp: J (2 l)^2 for two equal parts."""
    jump = np.array([[0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]])
    wide = make_ramps([np.linspace(0, 1, 7)], np.array([1.2]), jump)
    assert wide.wide_variation == pytest.approx(0.4**2)
    assert wide.variation == pytest.approx(0, abs=1e-15)  # each interval alone continues the other
    steep = make_ramps([np.linspace(0, 1, 7)], np.array([1.2]), np.round(jump))
    assert steep.wide_variation == pytest.approx(steep.variation) == pytest.approx(0.2**2)


def test_a_torque_of_constant_slope_has_no_jump():
    line = make_ramps([np.linspace(0, 1, 5), np.linspace(0, 1, 5)], np.array([0.1, 0.7]), np.linspace(0, 8, 9)[None])
    bent = make_ramps([np.linspace(0, 1, 5)], np.array([0.8]), np.array([[0.0, 1.0, 2.0, 3.0, 4.0]]))
    assert bent.wide_variation == pytest.approx(0, abs=1e-15)
    assert line.wide_variation == line.variation  # the slope in time changes at the end of the first phase alone


@pytest.mark.parametrize("number", [60, 83, 94])
def test_the_estimate_of_random_problems(number):
    """Truth: the lowest cost of several starts on finer grids, stored by `tests.benchmarks.random_problems`."""
    best = json.loads(BEST_KNOWN.read_text(encoding="utf-8"))["problems"][str(number)]["best"]
    gait = solve(draw_problem(number))
    assert is_right(gait.solver.cost_error, abs(gait.solver.objective / best - 1))
