"""Robust plans: the worst violated scenario is added until none is left, and unseen scenarios are survived."""

import dataclasses
import math

import pytest

from gaitopt import (
    Collocation,
    Execution,
    GainSearchOptions,
    GaitProblem,
    InputError,
    Limits,
    Status,
    compass_biped,
    feedforward,
    solve,
)
from gaitopt.design import RobustProblem, Scenario, Scenarios, check_scenarios, robust_plan, solve_scenarios
from gaitopt.design.scenario_test import Walk, worst_walk
from gaitopt.errors import NoGaitError
from gaitopt.motion.gait_table import tabulate_gait

SCENARIOS = Scenarios(ranges={"friction": (0.1, 0.2)}, push=0.1)
QUICK = GainSearchOptions(samples=0, starts=1, evaluations=4)


def problem(**changes):
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.15,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=6),
        objective="torque_squared",
    ).replace(**changes)


@pytest.fixture(scope="module")
def plan():
    return solve_scenarios(problem(), SCENARIOS, search=QUICK)


@pytest.mark.slow
def test_the_worst_scenario_is_the_lowest_friction_and_none_is_violated(plan):
    assert plan.robust
    assert [scenario.parameters for scenario in plan.selected] == [{"friction": 0.1}]
    assert plan.gait.motion.parameters["friction"] == 0.1
    assert plan.additional_cost == pytest.approx(plan.gait.solver.objective / plan.nominal.solver.objective - 1)
    assert plan.additional_cost > 0


@pytest.mark.slow
def test_the_table_states_the_friction_of_the_plan_and_the_nominal_one(plan):
    facts = dict(tabulate_gait(plan.recorded_gait()))
    friction = "friction 0.1 (the lowest of the added scenarios, for which the gait is planned; nominal 0.15)"
    assert friction in facts["robot"]
    assert "candidate scenarios survived" in facts["robustness"]


def test_unseen_scenarios_are_survived_by_the_plan_and_not_by_the_nominal_optimum(plan):
    robust = check_scenarios(plan.gait, plan.law, SCENARIOS, count=12)
    assert (robust.survived, robust.recovered, robust.failures) == (12, 12, ())
    assert str(robust) == "maintained at 12 of 12 friction coefficients and after 12 of 12 pushes"
    nominal = check_scenarios(plan.nominal, plan.nominal_law, SCENARIOS, count=12)
    assert nominal.survived < 12
    assert nominal.recovered < 12
    assert all(walk.scenario.parameters["friction"] < 0.15 for walk in nominal.failures)


def test_a_push_needs_feedback(plan):
    open_loop = feedforward(plan.gait.robot, plan.gait.motion)
    test = check_scenarios(plan.gait, open_loop, SCENARIOS, count=4)
    assert test.survived == 4
    assert test.recovered < 4


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_workers(plan):
    few = Scenarios(ranges={"friction": (0.1, 0.12)}, push=0.3, steps=5)
    one = check_scenarios(plan.gait, plan.law, few, count=3)
    two = check_scenarios(plan.gait, plan.law, few, count=3, execution=Execution(workers=2))
    assert one == two


def test_a_mass_that_differs_from_the_plan_is_tuned_for():
    ranges = {"hip_mass": (1.8, 2.2)}
    scenarios = Scenarios(ranges=ranges, tolerance=0.05, values=2)
    plan = solve_scenarios(problem(friction=0.3), scenarios, search=QUICK)
    assert plan.robust
    assert plan.additional_cost == pytest.approx(0, abs=1e-6)
    assert check_scenarios(plan.gait, plan.law, scenarios, count=4).survived == 4


@pytest.mark.slow
def test_the_open_loop_and_a_law_of_a_function_are_robust_without_pushes():
    steady = Scenarios(ranges={"friction": (0.14, 0.16)}, values=2, steps=4)
    plan = solve_scenarios(problem(), steady, law="feedforward")
    assert plan.robust
    assert (plan.tuning, plan.gains, plan.law.name) == (None, {}, "feedforward")
    assert plan.gait.motion.parameters["friction"] == 0.14
    same = solve_scenarios(problem(), steady, law=lambda robot, motion, limit: feedforward(robot, motion))
    assert same.law.name == "feedforward"
    assert same.robust


def test_a_plan_that_is_not_robust_states_scenario_quantity_and_tolerance():
    heavy = Scenarios(ranges={"hip_mass": (1.99, 2.01)}, values=2, steps=3)
    plan = solve_scenarios(problem(), heavy, law="feedforward")
    assert str(plan).startswith(
        "not robust: 0 of 2 candidate scenarios survived under feedforward, additional cost +0.0 %"
    )
    assert "worst: hip_mass " in str(plan)
    assert str(plan).endswith(" from the plan after 3 steps (tolerance 0.0001)")
    assert plan.advice.startswith("The periodic motion of a gait depends on hip_mass, so the walk does not return")
    stated = float(plan.advice.rpartition("tolerance=")[2].rstrip(")."))
    assert plan.violated.distance < stated < 3 * plan.violated.distance
    test = check_scenarios(plan.gait, plan.law, heavy, count=2)
    assert str(test) == f"maintained in {test.survived} of 2 scenarios"


def test_a_walk_far_from_the_plan_needs_another_law_and_not_a_larger_tolerance(plan):
    near, far = (Walk(Scenario({"hip_mass": 2.1}), 20, distance, "th1") for distance in (0.04, 0.2))
    assert plan.explain_deviation(near).endswith("tolerance=0.08).")
    advice = plan.explain_deviation(far)
    others = {"joint_pd", "computed_torque", "lqr", "step_lqr", "push_off"} - {plan.law.name}
    assert all(name in advice.partition("another law (law=), such as ")[2] for name in others)
    assert ("more evaluations to tune its gains (search=)" in advice) is bool(plan.gains)
    assert "tolerance=" not in advice


@pytest.mark.parametrize(("law", "reason"), [(3, "law must be a name"), (lambda *_: 3, "but returned int")])
def test_invalid_laws(law, reason):
    with pytest.raises(InputError, match=reason):
        solve_scenarios(problem(), SCENARIOS, law=law)


def test_candidates_cover_the_ends_of_the_ranges_and_random_scenarios_are_seeded():
    both = Scenarios(ranges={"friction": (0.1, 0.2), "slope": (-0.01, 0.01)}, values=2, push=0.1, pushes=1)
    assert len(both.candidates()) == 8
    assert Scenario({"friction": 0.2, "slope": -0.01}, 0) in both.candidates()
    assert both.draw(3, 1, pushed=True) == both.draw(3, 1, pushed=True) != both.draw(3, 2, pushed=True)
    assert all(0.1 <= one.parameters["friction"] <= 0.2 for one in both.draw(20, 1, pushed=False))


def test_the_worst_walk_is_the_shortest_and_then_the_farthest():
    walks = [
        Walk(Scenario({"friction": mu}), steps, size)
        for mu, steps, size in ((0.1, 3, math.inf), (0.11, 1, math.inf), (0.12, 20, 0.5), (0.13, 20, 0.0))
    ]
    assert worst_walk(walks, 1e-3) is walks[1]
    assert worst_walk(walks[2:], 1e-3) is walks[2]
    assert worst_walk(walks[3:], 1e-3) is None


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"ranges": {"friction": (0.2, 0.1)}}, "with lower < upper, got"),
        ({"ranges": {"friction": (0.1, math.inf)}}, "lower, upper"),
        ({"push": -1}, "push"),
        ({"steps": 0}, "steps"),
    ],
)
def test_invalid_scenarios_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        Scenarios(**fields)


def test_unknown_parameters_and_frictions_without_a_gait_are_refused():
    with pytest.raises(InputError, match="no parameter 'frction'"):
        solve_scenarios(problem(), Scenarios(ranges={"frction": (0.1, 0.2)}))
    assert not solve(problem(friction=0.02)).status.ok
    with pytest.raises(NoGaitError, match=r"No gait was found at friction 0\.02.*Conflicts: .*friction is 0\.02: "):
        solve_scenarios(problem(), Scenarios(ranges={"friction": (0.02, 0.2)}, values=2), search=QUICK)


def test_an_interrupt_of_a_solve_ends_the_planning(monkeypatch):
    """Otherwise the solve from the second start would continue, and its gait would hide the interrupt."""
    gait = solve(problem(transcription=Collocation(intervals=10)))
    stops, frictions = [Status.INTERRUPTED, Status.SOLVED], []

    def solve_interrupted(stated):
        frictions.append(stated.friction)
        return gait.replace_fields(status=stops[len(frictions) - 1])

    monkeypatch.setattr(robust_plan, "solve", solve_interrupted)
    with pytest.raises(KeyboardInterrupt):
        robust_plan._plan(problem(), [Scenario({"friction": 0.1})], gait)
    assert frictions == [0.1]


def test_an_interrupt_of_the_tuning_ends_the_planning(monkeypatch):
    """Tuning by itself keeps the best gains."""
    tune = robust_plan.tune_feedback

    def interrupted(*arguments, **options):
        return dataclasses.replace(tune(*arguments, **options), search_interrupted=True)

    monkeypatch.setattr(robust_plan, "tune_feedback", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solve_scenarios(problem(), SCENARIOS, search=QUICK)


@pytest.mark.parametrize(
    ("name", "ends"), [("friction", (0.2, 0.3)), ("friction", (0.05, 0.14)), ("slope", (0.01, 0.02))]
)
def test_a_range_that_excludes_the_nominal_value_is_refused(name, ends):
    message = rf"range of {name} must contain the nominal value of the problem, .*extend the range, or change {name}"
    scenarios = Scenarios(ranges={name: ends})
    with pytest.raises(InputError, match=message):
        solve_scenarios(problem(), scenarios)
    with pytest.raises(InputError, match=message):
        RobustProblem(problem(), scenarios)


def test_the_nominal_value_may_be_an_end_of_its_range_up_to_rounding():
    for ends in ((0.15, 0.2), (0.1, 0.15), (0.1, 0.15 * (1 - 1e-12))):
        Scenarios(ranges={"friction": ends}).check_problem(problem())
