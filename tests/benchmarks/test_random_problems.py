"""The random problems: drawn alike in every process, stored one by one, and summarised without a solve."""

import json

import pytest

from tests.benchmarks import random_problems, random_problems_page
from tests.benchmarks.random_problems import BEST_KNOWN, COUNT, draw_problem


def test_problems_are_drawn_from_their_number_alone():
    assert draw_problem(7).describe() == draw_problem(7).describe()
    assert draw_problem(7).describe() != draw_problem(13).describe()
    kinds = {(str(draw_problem(n).sequence), draw_problem(n).objective.name) for n in range(6)}
    assert len(kinds) == 6


def test_the_first_problem_is_that_of_the_stored_costs():
    # Printed once; NumPy keeps the streams of its generators.
    assert draw_problem(0).friction == pytest.approx(0.11157991865776322, rel=1e-12)


def test_every_problem_has_a_best_known_cost():
    stored = json.loads(BEST_KNOWN.read_text(encoding="utf-8"))
    assert stored["seed"] == random_problems.SEED
    assert set(stored["problems"]) == set(map(str, range(COUNT)))
    for number, row in stored["problems"].items():
        problem = draw_problem(int(number))
        assert (row["sequence"], row["objective"]) == (str(problem.sequence), problem.objective.name)
        assert row["best"] <= min(row["fine"] + row["finest"]) * (1 + 1e-12)


def test_a_run_continues_after_the_rows_that_are_stored(tmp_path):
    file, computed = tmp_path / "rows.json", []

    def compute(number):
        if number == 2 and len(computed) == 2:
            raise KeyboardInterrupt
        computed.append(number)
        return {"number": number}

    with pytest.raises(KeyboardInterrupt):
        random_problems.run(compute, 4, file)
    assert json.loads(file.read_text())["problems"] == {"0": {"number": 0}, "1": {"number": 1}}
    computed.append(-1)
    assert random_problems.run(compute, 4, file)["problems"].keys() == {"0", "1", "2", "3"}
    assert computed == [0, 1, -1, 2, 3]


ROW = {
    "sequence": "stick | stick",
    "objective": "cost_of_transport",
    "status": "solved",
    "cost": 1.004,
    "plan": 1.004,
    "minimised": 1.00405,
    "replayed": 1.004,
    "verified": "solved",
    "estimate": 0.003,
    "limit": 1.002,
    "seconds": 0.5,
    "processor_seconds": 0.5,
    "build_seconds": 0.1,
}


def test_shares_are_those_of_the_rows():
    rows = {
        "0": ROW,
        "1": ROW | {"cost": 1.01, "minimised": 1.02, "verified": "not_verified", "estimate": 0.1},
        "2": ROW | {"status": "infeasible", "cost": None},
    }
    results = {"problems": rows, "date": "2026-01-01", "versions": {"gaitopt": "0", "casadi": "3"}}
    best = {"problems": {name: {"best": 1.0} for name in rows}, "date": "2026-01-01"}
    summary = random_problems_page.summarise(results, best).splitlines()
    assert summary[0] == "- solved: 2 of 3; of these, failed the replay: 1"
    assert summary[1] == "- within 0.5 % of the best known cost: 1 of 3 with a known gait"
    assert summary[2].endswith("of 0.0001: 1 of 2")
    assert summary[3] == "- estimate within a factor of 3 of the error of the grid: 1 of 2"
    assert summary[4] == "- estimate within a factor of 3 of the excess over the best known cost: 1 of 2"
    page = random_problems_page.compose_page(results, best).splitlines()
    (first,) = [line for line in page if line.startswith("| 0 |")]
    assert first.split(" | ")[5:10] == ["1.004", "1", "0.400", "0.200", "0.300"]
