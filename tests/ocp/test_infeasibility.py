"""Infeasible problems: quick reports with the limits that conflict, distinguished from iteration limits."""

import math
from dataclasses import replace

import pytest

from gaitopt import Collocation, Ipopt, Limits, RandomPerturbation, StabilityBound, Status, solve
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.solution.conflict_search import elastic_solver
from gaitopt.ocp.solution.feasibility import ElasticProblem
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.infeasibility import conclude_failure
from gaitopt.ocp.solution.iteration_limits import COLD_START_ITERATIONS, limit_iterations
from gaitopt.ocp.solution.radius_conflict import check_conflicts_with_radius
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.progress import silent

COARSE = Collocation(intervals=10, tolerance=math.inf)
SMOOTH = {"objective": "torque_squared", "transcription": COARSE}
BOUND = StabilityBound(radius=0.5)
WITHOUT_BOUND = ", even without the bound on the spectral radius"


@pytest.fixture(scope="module")
def weak(reference_problem):
    """Return a problem whose ankle is too weak."""
    return reference_problem(torque=0.3, **SMOOTH)


def test_a_torque_that_is_too_low_is_named_with_one_that_would_do(weak):
    gait = solve(weak)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.message.startswith("no feasible motion found near any of 2 initial guesses: ")
    (conflict,) = gait.solver.conflicts
    assert (conflict.name, conflict.setting, conflict.limit) == ("torque limit of ankle", "Limits.torque", 0.3)
    assert conflict.separable
    assert conflict.sufficient == pytest.approx(conflict.limit + 1.02 * conflict.missing)
    for ankle, status in ((conflict.sufficient, Status.SOLVED), (0.3 + 0.9 * conflict.missing, Status.INFEASIBLE)):
        assert solve(weak.replace(limits=Limits(torque={"ankle": ankle, "hip": 0.3}))).status is status


@pytest.mark.parametrize(
    ("change", "setting"),
    [
        ({"speed": 3.0}, "speed"),
        ({"speed": (3.0, 4.0)}, "speed"),
        ({"step_length": 1.2, "friction": 0.1, "torque": 16.0}, "step_length"),
        ({"friction": 0.03}, "friction"),
    ],
)
def test_a_limit_that_conflicts_is_confirmed_by_its_sufficient_value(reference_problem, change, setting):
    problem = reference_problem(**SMOOTH, **change)
    found = {conflict.setting: conflict for conflict in solve(problem).solver.conflicts}
    assert solve(problem.replace(**{setting: found[setting].sufficient})).status is Status.SOLVED


def test_limits_that_only_suffice_together_are_marked(reference_problem):
    problem = reference_problem(friction=0.02, speed=1.5, **SMOOTH)
    gait = solve(problem)
    changes = {conflict.setting: conflict.sufficient for conflict in gait.solver.conflicts}
    assert set(changes) == {"speed", "step_length"}
    assert not any(conflict.separable for conflict in gait.solver.conflicts)
    assert str(gait.solver.conflicts[0]).endswith("would suffice if the other conflicting limits were relaxed too")
    assert solve(problem.replace(**changes)).status is Status.SOLVED
    assert solve(problem.replace(speed=changes["speed"])).status is Status.INFEASIBLE
    with_bound = check_conflicts_with_radius(problem.replace(stability=BOUND), gait, [], Ipopt(), silent)
    assert with_bound.solver.conflicts == gait.solver.conflicts
    assert with_bound.solver.message == gait.solver.message + WITHOUT_BOUND


def test_conflicts_not_examined_with_the_bound_of_the_radius_are_those_without_it(weak, monkeypatch):
    gait = solve(weak)
    monkeypatch.setattr("gaitopt.ocp.solution.radius_conflict._relax_each", lambda *_: {})
    monkeypatch.setattr("gaitopt.ocp.solution.radius_conflict._solve_without", lambda *_: None)
    problem = weak.replace(stability=StabilityBound(radius=50))
    for failure in (gait, gait.with_failure(Status.INFEASIBLE, gait.solver.message)):
        concluded = check_conflicts_with_radius(problem, failure, [LinearGuess()], Ipopt(), silent)
        assert concluded.solver.conflicts == failure.solver.conflicts
        assert concluded.solver.message == gait.solver.message + WITHOUT_BOUND


def test_both_ends_of_a_range_of_an_angle_are_named_if_both_conflict(reference_problem):
    limits = Limits(torque=6, angle={"th1": (-0.05, 0.05)})
    gait = solve(reference_problem(limits=limits, **SMOOTH))
    values = {conflict.name: conflict.sufficient for conflict in gait.solver.conflicts}
    lower, upper = values["lower limit of angle th1"], values["upper limit of angle th1"]
    assert not any(conflict.separable for conflict in gait.solver.conflicts)

    def status(*ends):
        return solve(reference_problem(limits=Limits(torque=6, angle={"th1": ends}), **SMOOTH)).status

    assert status(lower, upper) is Status.SOLVED
    assert status(lower, 0.05) is status(-0.05, upper) is Status.INFEASIBLE


def test_the_hidden_gait_needs_a_little_more_torque(reference_problem):
    """Infeasible only under 6 N m, see the findings on "slip+ stick slip- | slip+": with 12 N m there is a gait."""
    gait = solve(reference_problem(sequence="slip+ stick slip- | slip+", friction=0.25, **SMOOTH))
    assert gait.status is Status.INFEASIBLE
    (torque,) = [conflict for conflict in gait.solver.conflicts if conflict.name == "torque limit of ankle"]
    assert 6 < torque.sufficient < 12
    # The cone of the sticking foot is a condition of the sequence, which no value of the friction removes.
    assert not any(math.isnan(conflict.sufficient) for conflict in gait.solver.conflicts)


def test_the_fine_grid_of_an_infeasible_problem_is_never_solved(reference_problem, monkeypatch):
    grids, solve_on_grid = set(), SingleStart.solve_on_grid

    def record(start, method, *arguments):
        grids.add(method.intervals)
        return solve_on_grid(start, method, *arguments)

    monkeypatch.setattr(SingleStart, "solve_on_grid", record)
    assert solve(reference_problem(torque=0.3)).status is Status.INFEASIBLE
    assert grids == {(10,)}


def test_no_further_starts_are_solved_once_the_conflict_is_known(weak):
    starts = []
    gait = solve(weak, starts=5, observer=lambda step: starts.append(step.number == 0))
    assert gait.solver.message.startswith("no feasible motion found near any of 2 initial guesses: ")
    assert sum(starts) < 12  # the first start, two motions of least excess, and a few limits one by one


def test_a_failure_with_a_feasible_motion_becomes_a_gait(reference_problem):
    problem = reference_problem(**SMOOTH)
    failure = solve_from_start(problem, RandomPerturbation(1), Ipopt(max_iterations=3), silent)
    assert failure.status is Status.ITERATION_LIMIT
    gait = conclude_failure(problem, failure.with_failure(Status.FAILED, ""), [LinearGuess()], Ipopt(), silent)
    assert gait.status is Status.SOLVED
    assert gait.problem["guess"] == "a motion that satisfies all limits"


def test_a_problem_that_is_feasible_on_the_fine_grid_alone_is_solved_there(reference_problem):
    """The ankle needs 1.52 N m on the coarsest grid, 1.43 N m on the fine one."""
    limits = Limits(torque={"ankle": 1.47, "hip": 6})
    assert solve(reference_problem(limits=limits, **SMOOTH)).status is Status.INFEASIBLE
    gait = solve(reference_problem(limits=limits, objective="torque_squared"))
    assert gait.status is Status.SOLVED
    assert gait.problem["guess"] == "a motion that satisfies all limits"


def test_a_start_that_needs_more_iterations_is_repeated_with_all_of_them(reference_problem, monkeypatch):
    """The search for a feasible motion begins early, but a start that succeeds gives the same gait as without it."""
    problem = reference_problem(transcription=COARSE)
    expected = solve(problem, starts=1)
    monkeypatch.setattr("gaitopt.ocp.solution.iteration_limits.COLD_START_ITERATIONS", 5)
    gait = solve(problem, starts=1)
    assert gait.status is Status.SOLVED
    assert gait.solver.objective == expected.solver.objective
    assert gait.problem["guess"] == expected.problem["guess"]


def test_a_feasible_problem_that_is_not_solved_is_not_infeasible(reference_problem, monkeypatch):
    problem = reference_problem(**SMOOTH)
    failure = solve(problem, solver=Ipopt(max_iterations=3))
    assert failure.status is Status.ITERATION_LIMIT
    wrong = failure.with_failure(Status.INFEASIBLE, "Infeasible_Problem_Detected")
    monkeypatch.setattr("gaitopt.ocp.solution.infeasibility.solve_from_start", lambda *_: wrong)
    concluded = conclude_failure(problem, wrong, [LinearGuess()], Ipopt(), silent)
    assert concluded.status is Status.FAILED
    assert concluded.solver.conflicts == ()
    assert concluded.solver.message.endswith("from a motion that satisfies all limits on a coarse grid")


@pytest.mark.parametrize(
    ("status", "has_fixed_gait", "conclusion"),
    [
        (Status.INFEASIBLE, True, Status.FAILED),
        (Status.INFEASIBLE, False, Status.FAILED),
        (Status.TIME_LIMIT, True, Status.TIME_LIMIT),
    ],
)
def test_a_problem_with_a_feasible_motion_at_fixed_parameters_is_not_infeasible(
    reference_problem, monkeypatch, status, has_fixed_gait, conclusion
):
    problem = reference_problem(free={"leg_com": (0.7, 0.9)}, **SMOOTH)
    failure = solve_from_start(problem, LinearGuess(), Ipopt(max_iterations=3), silent)
    wrong = failure.with_failure(Status.INFEASIBLE, "Infeasible_Problem_Detected")
    minimise_excess = ElasticProblem.minimise_excess

    def fail_with_free_parameters(elastic, guess):
        result = minimise_excess(elastic, guess)
        return replace(result, status=Status.INFEASIBLE) if elastic.problem.free else result

    def solve_fixed(stated, *arguments):
        if has_fixed_gait and not stated.free:
            return solve_from_start(stated, *arguments)
        return wrong.with_failure(status, "stopped")

    monkeypatch.setattr(ElasticProblem, "minimise_excess", fail_with_free_parameters)
    monkeypatch.setattr("gaitopt.ocp.solution.infeasibility.solve_from_start", solve_fixed)
    assert conclude_failure(problem, wrong, [LinearGuess()], Ipopt(), silent).status is conclusion


def test_a_time_limit_of_the_search_with_fixed_parameters_is_reported(reference_problem, monkeypatch):
    problem = reference_problem(free={"leg_com": (0.7, 0.9)}, **SMOOTH)
    failure = solve_from_start(problem, LinearGuess(), Ipopt(max_iterations=3), silent)
    minimise_excess = ElasticProblem.minimise_excess

    def stop_with_fixed_parameters(elastic, guess):
        result = minimise_excess(elastic, guess)
        return replace(result, status=Status.INFEASIBLE if elastic.problem.free else Status.TIME_LIMIT)

    monkeypatch.setattr(ElasticProblem, "minimise_excess", stop_with_fixed_parameters)
    gait = conclude_failure(problem, failure, [LinearGuess()], Ipopt(), silent)
    assert gait.status is Status.TIME_LIMIT


@pytest.mark.parametrize("number", [1, 3, 6])
def test_an_interrupt_stops_the_search_for_a_feasible_motion(weak, number):
    """Solve `number` is the first start, a feasible motion, or the test of one limit."""
    begun = []

    def observe(step):
        begun.append(step.number == 0)
        if sum(begun) == number and step.number == 2:
            raise KeyboardInterrupt

    gait = solve(weak, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert sum(begun) == number
    assert gait.solver.message == "User_Requested_Stop"


def test_the_time_limit_ends_the_search(weak):
    gait = conclude_failure(weak, solve(weak), [LinearGuess()], Ipopt(time_limit=1e-9), silent)
    assert gait.status is Status.TIME_LIMIT
    assert gait.solver.conflicts == ()


def test_solvers_of_the_search_keep_the_options_of_the_user():
    given = Ipopt(max_iterations=30, time_limit=5, linear_solver="spral")
    for solver in (given, Newton(fallback=given)):
        ipopt = elastic_solver(solver)
        assert (ipopt.max_iterations, ipopt.time_limit, ipopt.linear_solver) == (30, 5, "spral")
    assert elastic_solver(Ipopt(), 3).max_iterations > elastic_solver(Ipopt(), 2).max_iterations
    assert limit_iterations(given) == given
    assert limit_iterations(Newton()).fallback.max_iterations == COLD_START_ITERATIONS
    custom = object()
    assert limit_iterations(custom) is custom
    assert elastic_solver(custom) is custom
