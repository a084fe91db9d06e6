"""Studies classify a failure as solve does: a start that was stopped early is continued to its end."""

from dataclasses import replace

from gaitopt import LinearGuess, Status
from gaitopt.study import multistart
from gaitopt.study.storage.failure_reason import explain_failure
from tests.study.conftest import quick_problem


def test_a_failure_at_the_iteration_limit_is_concluded(monkeypatch):
    problem = quick_problem(friction=0.02, speed=1.5)
    stopped = replace(multistart.solve_cold(problem, 1)[0], status=Status.ITERATION_LIMIT)
    assert multistart.verify_best(problem, [stopped]).status is Status.INFEASIBLE
    calls = []
    monkeypatch.setattr(multistart, "solve_start", lambda *arguments: calls.append(arguments))
    concluded = multistart.verify_best(problem, [replace(stopped, status=Status.INFEASIBLE)])
    assert concluded.status is Status.INFEASIBLE
    assert [conflict.setting for conflict in concluded.solver.conflicts] == ["speed", "step_length"]
    assert explain_failure(concluded).startswith("no gait found; speed is 1.5 m/s: ")
    assert multistart.verify_best(problem, [concluded]) is concluded
    assert calls == []


def test_a_start_that_only_needed_more_iterations_becomes_a_gait():
    problem = quick_problem()
    solved = multistart.solve_cold(problem, 1)[0]
    stopped = replace(solved, status=Status.ITERATION_LIMIT)
    concluded = multistart.verify_best(problem, [stopped])
    assert concluded.certificate is None  # like those of all gaits of studies
    assert concluded.status is Status.SOLVED
    assert concluded.verification.passed
    assert concluded.problem["intervals"] == solved.problem["intervals"]


def test_an_inaccurate_plan_is_not_infeasible():
    """It satisfies all limits at its nodes, also if no motion that does is found near other starts."""
    problem = quick_problem(friction=0.02, speed=1.5)
    failure = multistart.solve_cold(problem, 1)[0]
    inaccurate = failure.replace_fields(
        status=Status.PLAN_INACCURATE, solver=failure.solver.replace_fields(warnings=("it is inaccurate.",))
    )
    assert inaccurate.solver.violations  # which an inaccurate plan may have: they are smaller than its inaccuracy
    assert explain_failure(inaccurate) == "the plan is inaccurate: it is inaccurate."
    concluded = multistart.verify_best(problem, [inaccurate])
    assert concluded.status is Status.PLAN_INACCURATE
    assert concluded.solver.conflicts == ()


def test_a_start_that_stays_far_from_feasible_ends_early_and_earlier_after_a_failure():
    problem = quick_problem(sequence="slip+ slip- | stick", objective="cost_of_transport", friction=0.2)
    iterations = []
    for after_failure in (False, True):
        (failure,) = multistart.solve_coarse(problem, [LinearGuess()], after_failure=after_failure)
        assert failure.status is Status.ITERATION_LIMIT
        iterations.append(failure.solver.iterations)
    first, later = (most - 1 for most in multistart.MOST_INFEASIBLE_ITERATIONS)  # the first iterate has number 0
    assert multistart.START_SOLVER.fallback.max_iterations > iterations[0] >= first > iterations[1] >= later
