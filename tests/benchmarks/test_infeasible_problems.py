"""The infeasible problems: drawn alike in every process, checked by changed limits, and summarised without a solve."""

import json

import pytest

from gaitopt.motion.conflict import Conflict
from tests.benchmarks import infeasible_problems, infeasible_problems_page
from tests.benchmarks.infeasible_problems import change, check_conflicts, draw_demanding, draw_problem

TORQUE = Conflict(
    name="torque limit of hip",
    setting="Limits.torque",
    limit=1.0,
    missing=1.0,
    sufficient=2.0,
    unit="N m",
    separable=True,
)


def test_problems_are_drawn_from_their_number_alone():
    assert draw_problem(7, "speed").describe() == draw_problem(7, "speed").describe()
    kinds = [draw_demanding(number)[0] for number in range(6)]
    assert kinds == ["torque", "torque", "step", "step", "speed", "speed"]
    # Printed once; NumPy keeps the streams of its generators.
    assert draw_problem(0, "solvable").friction == pytest.approx(0.10808960535724847, rel=1e-12)


def test_a_limit_is_changed_to_its_sufficient_value_or_removed():
    problem = draw_problem(0, "torque")
    ankle = problem.limits.torques(problem.robot.actuators)[0]
    relaxed, removed = (change(problem, TORQUE, removed=removed).limits for removed in (False, True))
    assert list(relaxed.torques(problem.robot.actuators)) == [ankle, 2.0]
    assert list(removed.torques(problem.robot.actuators)) == [ankle, float("inf")]


def test_limits_are_removed_if_their_sufficient_values_do_not_suffice(monkeypatch):
    solved = []

    def report(problem, group, *, removed):
        solved.append((len(group), removed))
        return "solved" if removed else "infeasible"

    monkeypatch.setattr(infeasible_problems, "solve_changed", report)
    (group,) = check_conflicts(None, (TORQUE,))
    assert (group["relaxed"], group["removed"]) == ("infeasible", "solved")
    assert solved == [(1, False), (1, True)]


ROW = {
    "kind": "torque",
    "sequence": "stick | stick",
    "objective": "cost_of_transport",
    "status": "infeasible",
    "processor_seconds": 0.4,
    "feasible_status": "solved",
    "feasible_seconds": 0.1,
    "groups": [{"limits": ["torque"], "relaxed": "solved", "removed": None}],
}


def test_shares_are_those_of_the_rows():
    failed = {"limits": ["speed"], "relaxed": "infeasible", "removed": "plan_inaccurate"}
    rows = {
        "0": ROW,
        "1": ROW | {"processor_seconds": 0.6, "groups": [*ROW["groups"], failed]},
        "2": ROW | {"groups": [failed | {"removed": "solved"}]},
        "3": ROW | {"groups": []},
        "4": ROW | {"status": "solved"},
        "5": ROW | {"status": "plan_inaccurate", "processor_seconds": 8.0},
    }
    results = {"problems": rows, "date": "2026-01-01", "versions": {"gaitopt": "0", "casadi": "3"}}
    summary = infeasible_problems_page.summarise(results).splitlines()
    assert summary[0] == "- reported as infeasible: 4 of 4"
    assert summary[2].startswith("- reported within 5 times this time: 3 of 4")
    assert summary[3:] == ["- confirmed: 2 of 4", "- confirmed with the sufficient values: 1", summary[-1]]
    assert summary[-1].endswith("1 with the status `plan_inaccurate`, after at most 8.0 s of processor time")
    page = infeasible_problems_page.compose_page(results)
    assert "torque (solved)<br>speed (infeasible; removed: plan inaccurate) |" in page


def test_the_stored_results_are_those_of_the_page():
    results = json.loads(infeasible_problems.RESULTS.read_text(encoding="utf-8"))
    assert results["seed"] == infeasible_problems.SEED
    assert infeasible_problems.PAGE.read_text(encoding="utf-8") == infeasible_problems_page.compose_page(results)
    rows = [row for _, row in infeasible_problems_page.list_infeasible(results)]
    assert len(rows) == infeasible_problems.COUNT
    assert sum(map(infeasible_problems_page.is_confirmed, rows)) >= 0.9 * len(rows)
