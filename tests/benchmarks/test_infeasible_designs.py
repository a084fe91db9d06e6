"""The infeasible designs: drawn alike in every process, and their limits changed one by one."""

import json

from gaitopt.motion.conflict import Conflict
from tests.benchmarks import infeasible_designs, infeasible_designs_page
from tests.benchmarks.infeasible_designs import KINDS, check_set, draw_problem
from tests.benchmarks.infeasible_problems import change


def conflict(name, setting, limit, sufficient):
    return Conflict(
        name=name, setting=setting, limit=limit, missing=1.0, sufficient=sufficient, unit="1", separable=False
    )


def test_designs_are_drawn_from_their_number_alone():
    assert draw_problem(3)[1].describe() == draw_problem(3)[1].describe()
    assert tuple(draw_problem(number)[0] for number in range(5)) == KINDS
    assert [draw_problem(number)[1].stability is None for number in range(4)] == [False, True, True, False]


def test_bounds_of_free_parameters_and_of_the_radius_are_changed_or_removed():
    problem = draw_problem(0)[1]
    lower, upper = problem.free["leg_com"]
    limit = conflict("leg_com", "free", upper, 1.3)
    assert change(problem, limit, removed=False).free["leg_com"] == (lower, 1.3)
    assert change(problem, limit, removed=True).free["leg_com"] == (lower, 1.55)
    radius = conflict("spectral radius", "StabilityBound.radius", problem.stability.radius, 0.9)
    assert change(problem, radius, removed=False).stability.radius == 0.9
    assert change(problem, radius, removed=True).stability is None


def test_a_set_is_smallest_if_no_part_of_it_suffices(monkeypatch):
    group = [conflict("speed", "speed", 3.0, 1.0), conflict("torque", "Limits.torque", 1.0, 2.0)]
    monkeypatch.setattr(
        infeasible_designs, "solve_changed", lambda _, limits, removed: "solved" if len(limits) == 2 else "infeasible"
    )
    row = {"groups": [check_set(None, group)]}
    assert row["groups"][0]["smaller"] == ["infeasible", "infeasible"]
    assert infeasible_designs_page.is_smallest(row)
    row["groups"][0]["smaller"][0] = "solved"
    assert not infeasible_designs_page.is_smallest(row)


def test_the_stored_results_are_those_of_the_page():
    results = json.loads(infeasible_designs.RESULTS.read_text(encoding="utf-8"))
    assert results["seed"] == infeasible_designs.SEED
    assert infeasible_designs.PAGE.read_text(encoding="utf-8") == infeasible_designs_page.compose_page(results)
    rows = [row for _, row in infeasible_designs_page.list_infeasible(results)]
    assert sum(map(infeasible_designs_page.is_smallest, rows)) >= 55 / 60 * len(rows)
