"""The course of a solve: coarse grids, refinement, other starts, and what is kept of one that is stopped."""

import gc
import math
import weakref

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    ContactSequence,
    InputError,
    Ipopt,
    LinearGuess,
    Margins,
    Newton,
    RandomPerturbation,
    Status,
    WarmStart,
    solve,
    verify,
)
from gaitopt.lazy import Deferred
from gaitopt.ocp.solution import single_start, start_selection
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.inaccurate_plans import InaccuratePlans
from gaitopt.ocp.solution.mesh_refinement import approach_through_coarse_grids, refine_mesh
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.solution.start_selection import solve_from_starts
from gaitopt.ocp.statement.initial_guess import DelayedSwing
from gaitopt.progress import silent
from tests.benchmarks.random_problems import draw_problem
from tests.benchmarks.test_reliability import random_problem

SLIP = "slip+ stick | slip+"


def iterations(seen):
    """Return the number of iterations of each run of the solver."""
    starts = [i for i, step in enumerate(seen) if step.number == 0]
    return [len(run) - 1 for run in np.split(np.array(seen, dtype=object), starts[1:])]


def test_a_fine_grid_is_approached_through_coarse_ones():
    path = Collocation(intervals=320).list_grids(ContactSequence.parse(SLIP))
    assert [method.intervals for method in path[:-1]] == [(5, 10), (5, 20), (20, 80)]
    assert path[-1].intervals_for(ContactSequence.parse(SLIP)) == (80, 320)
    assert Collocation(intervals=20).list_grids(ContactSequence.parse(SLIP)) == [Collocation(intervals=20)]


def test_a_fine_grid_that_defeats_a_straight_line_is_solved(reference_problem):
    gait = solve(reference_problem(sequence=SLIP, intervals=80))
    assert gait.status is Status.SOLVED
    assert verify(gait).verification.passed


def test_going_on_from_a_gait_takes_fewer_iterations(reference_problem, solved):
    gait = solved(sequence=SLIP)
    cold = solve(reference_problem(sequence=SLIP, friction=0.141))
    warm = solve(reference_problem(sequence=SLIP, friction=0.141, guess=WarmStart(gait, "the one at 0.14")))
    assert warm.status is Status.SOLVED
    assert warm.solver.objective == pytest.approx(cold.solver.objective, rel=1e-5)
    assert warm.solver.iterations < 0.7 * cold.solver.iterations
    assert warm.problem["guess"] == "the one at 0.14"


def test_going_on_from_the_same_gait_ends_at_once(reference_problem, solved):
    seen = []
    gait = solve(reference_problem(sequence=SLIP, guess=WarmStart(solved(sequence=SLIP))), observer=seen.append)
    assert gait.status is Status.SOLVED
    assert len(seen) < 15


@pytest.mark.slow
def test_a_gait_that_was_gone_on_from_is_not_kept_alive(reference_problem):
    problem = reference_problem(objective="torque_squared", intervals=6)
    before = solve(problem)
    after, known = solve(problem.replace(speed=0.64, guess=WarmStart(before))), weakref.ref(before)
    del before
    gc.collect()
    assert known() is None
    assert after.motion.period > 0


@pytest.mark.parametrize("intervals", [20, (25, 40), pytest.param(80, marks=pytest.mark.slow)])
def test_multipliers_are_carried_to_another_grid(reference_problem, solved, intervals):
    guess = WarmStart(solved(sequence=SLIP))
    gait = solve(reference_problem(sequence=SLIP, guess=guess, transcription=Collocation(intervals=intervals)))
    assert gait.status is Status.SOLVED
    assert gait.solver.iterations < 60
    assert gait.solver.objective == pytest.approx(solved(sequence=SLIP).solver.objective, rel=5e-3)


def test_a_gait_of_another_sequence_is_a_start_too(reference_problem, solved):
    gait = solve(
        reference_problem(sequence="slip+ stick slip- | slip+", friction=0.12, guess=WarmStart(solved(sequence=SLIP)))
    )
    assert gait.status is Status.SOLVED
    assert gait.solver.objective < solved(sequence=SLIP, friction=0.12).solver.objective


@pytest.mark.slow
def test_of_several_starts_the_cheapest_is_kept():
    """The first and the last start lead to one optimum, the second to one of lower cost."""
    problem = draw_problem(12)
    guesses = [LinearGuess(), DelayedSwing(), RandomPerturbation(3)]
    costs = [solve_from_start(problem, guess, Newton(), silent).solver.objective for guess in guesses]
    (best,) = solve_from_starts(problem, guesses, Newton(), silent, Newton())
    assert best.status is Status.SOLVED
    assert best.solver.objective == pytest.approx(min(costs), rel=1e-8)
    assert min(costs) < 0.95 * costs[0]
    assert solve(problem, starts=4).solver.objective == pytest.approx(min(costs), rel=1e-6)


def test_an_object_that_is_not_a_problem_is_refused():
    with pytest.raises(InputError, match=r"problem must be a GaitProblem\(...\) or a PlanarProblem\(...\), got 'x'"):
        solve("x")


@pytest.mark.parametrize("starts", [0, 1.5, "two", True])
def test_a_number_of_starts_that_cannot_be(reference_problem, starts):
    with pytest.raises(InputError, match="starts must be"):
        solve(reference_problem(), starts=starts)


def test_a_start_that_leads_nowhere_is_followed_by_others(reference_problem):
    seen = []
    gait = solve(reference_problem(intervals=8), solver=Ipopt(max_iterations=2), observer=seen.append)
    assert gait.status is Status.ITERATION_LIMIT
    squared_torques, feasible_motions, further_starts = [2], [2, 2], [2, 2, 2]
    assert iterations(seen) == [*squared_torques, 2, *feasible_motions, *further_starts]


def test_an_interrupt_late_in_a_solve_keeps_the_best_iterate_that_meets_the_constraints(reference_problem):
    alone = Collocation(intervals=10, tolerance=math.inf)  # one grid only
    # The iterates of a smooth objective have its exact value; those of an absolute work have a bound.
    stated = {"sequence": SLIP, "friction": 0.2, "objective": "torque_squared"}
    problem, seen = reference_problem(transcription=alone, **stated), []
    whole = solve(problem, solver=Ipopt(), observer=seen.append)
    feasible = [step.number for step in seen if step.infeasibility <= 1e-6]
    stop = feasible[len(feasible) // 2]

    def observe(iteration):
        if iteration.number == stop:
            raise KeyboardInterrupt

    gait = solve(problem, solver=Ipopt(), observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert "the best feasible one" in gait.solver.message
    assert gait.solver.constraint_violation <= 1e-6
    best = min(step.objective for step in seen[: stop + 1] if step.infeasibility <= 1e-6)
    assert gait.solver.objective == pytest.approx(best, rel=1e-6)
    assert gait.solver.objective >= whole.solver.objective * (1 - 1e-6)


def test_an_interrupt_on_the_coarse_grid_ends_the_solve(reference_problem):
    seen = []

    def observe(iteration):
        seen.append(iteration.number)
        if iteration.number == 1:
            raise KeyboardInterrupt

    gait = solve(reference_problem(sequence=SLIP), observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert seen == [0, 1]
    assert gait.problem["intervals"] == [5, 10]


def test_an_interrupt_on_the_fine_grid_keeps_the_solution_of_the_coarse_one(reference_problem):
    runs = 0

    def observe(iteration):
        nonlocal runs
        runs += iteration.number == 0
        if runs == 2 and iteration.number == 1:
            raise KeyboardInterrupt

    gait = solve(reference_problem(sequence=SLIP), starts=1, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert "the result is the solution before this refinement" in gait.solver.message
    assert gait.problem["intervals"] == [5, 10]
    assert gait.solver.constraint_violation <= 1e-6


def test_a_grid_too_coarse_for_the_cone_is_doubled(reference_problem):
    # Four intervals of 190 ms and no margin: between the points at which it is held the force leaves the cone.
    gait = solve(
        reference_problem(
            torque=60.0,
            friction=0.1,
            margins=Margins(cone=0),
            transcription=Collocation(intervals=4, points=3, tolerance=0.1),
        )
    )
    assert gait.status is Status.PLAN_INACCURATE
    assert gait.problem["intervals"] == [16]
    assert any("the contact mode is violated by" in warning for warning in gait.solver.warnings)


def test_a_grid_too_coarse_for_its_tolerance_is_doubled_once_points_are_exhausted(reference_problem):
    method = Collocation(intervals=4, points=6, tolerance=1e-9)
    gait = solve(reference_problem(torque=60.0, friction=0.2, objective="torque_squared", transcription=method))
    assert gait.status is Status.SOLVED
    assert gait.problem["transcription"] == "collocation, 6 Lobatto points"
    assert gait.problem["intervals"][0] in (8, 16)
    assert gait.solver.error_between_nodes <= 1e-9


def test_a_small_margin_makes_up_for_a_coarse_grid(reference_problem):
    method = Collocation(intervals=4, points=3, tolerance=0.1)
    gait = solve(reference_problem(torque=60.0, friction=0.1, margins=Margins(cone=5e-3), transcription=method))
    assert gait.status is Status.SOLVED
    assert not gait.solver.warnings


@pytest.mark.slow
def test_a_force_that_leaves_its_cone_just_behind_a_node_is_met_by_a_finer_grid():
    """On its first grid this foot, once at rest, would slide again for a moment: its replay walks another sequence."""
    problem = random_problem(3).replace(margins=Margins(cone=0), transcription=Collocation(intervals=40))
    start = SingleStart(problem, LinearGuess(), Newton(), silent)
    coarse = approach_through_coarse_grids(start)
    assert coarse.transcription.structure.counts == (10, 40)
    assert coarse.drift < problem.transcription.tolerance
    assert coarse.between.outside > 5e-5
    fine = refine_mesh(start, coarse)
    assert min(fine.transcription.structure.counts) >= 20
    assert fine.between.outside < coarse.between.outside / 2
    assert verify(solve(random_problem(3))).verification.passed


def test_the_description_of_a_problem_is_evaluated_when_it_is_read(reference_problem):
    problem = reference_problem(objective="torque_squared", transcription=Collocation(intervals=10, tolerance=math.inf))
    gait = solve(problem, starts=1)
    assert isinstance(vars(gait)["problem"], Deferred)
    assert gait.problem["objective"] == "torque_squared"
    assert gait.problem["guess"] == "linear guess"
    assert gait.problem["intervals"] == [10]


def test_an_interrupt_between_two_grids_keeps_the_solution_on_the_last_one(reference_problem, monkeypatch):
    problem = reference_problem(objective="torque_squared", transcription=Collocation(intervals=10))
    expected = solve(problem, starts=1).solver.objective

    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(single_start, "refine_for_cost", interrupt)
        gait = solve(problem, starts=1)
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.objective == pytest.approx(expected, rel=1e-2)
    monkeypatch.setattr(single_start, "approach_through_coarse_grids", interrupt)
    with pytest.raises(KeyboardInterrupt):  # there is no solution yet
        solve(problem, starts=1)


@pytest.mark.parametrize("module", [single_start, start_selection])
def test_an_interrupt_on_the_coarsest_grid_keeps_its_solution(reference_problem, monkeypatch, module):
    problem, coarse = reference_problem(objective="torque_squared"), []
    solve_coarsest_grid = start_selection.solve_coarsest_grid

    def interrupt(start):
        coarse.append(solve_coarsest_grid(start))
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "solve_coarsest_grid", interrupt)
    if module is start_selection:
        gait = solve(problem, starts=3)
    else:
        gait = solve_from_start(problem, LinearGuess(), Newton(), silent, plans=InaccuratePlans())
    assert gait.status is Status.INTERRUPTED
    assert coarse
    assert gait.solver.objective == pytest.approx(coarse[-1].outcome.objective, rel=1e-9)
