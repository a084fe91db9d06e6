"""Infeasible random problems: the time to report them, and whether the limits that are named really conflict."""

import sys

from tests.benchmarks.infeasible_problems import COUNT, run
from tests.benchmarks.infeasible_problems_page import (
    LARGEST_RATIO,
    is_confirmed,
    list_infeasible,
    list_ratios,
    summarise,
)


def test_infeasible_problems_are_reported_quickly_with_the_limits_that_conflict(benchmark, tmp_path):
    results = benchmark.pedantic(lambda: run(COUNT, tmp_path / "rows.json"), rounds=1)
    print(f"\n{summarise(results)}", file=sys.stderr)
    ratios, rows = list_ratios(results), [row for _, row in list_infeasible(results)]
    within, named = int(sum(ratios <= LARGEST_RATIO)), sum(map(is_confirmed, rows))
    benchmark.extra_info.update(within=within, named=named)
    assert all(row["status"] == "infeasible" for row in rows)
    assert within >= 0.95 * len(rows)
    assert ratios.max() <= 10
    assert named >= 0.9 * len(rows)
