"""Cost of a branch of optimal gaits against cold solves, in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Target: 100 frictions from 0.10 to 0.25, every gait replayed, in less than the processor time of 30 cold solves, also of
those from a single start, and the costs of the best of 8 starts to 1e-6 on the same grid.
"""

import statistics

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, compass_biped, solve
from gaitopt.continuation import OptimumOptions, trace_optimum
from tests.benchmarks.conftest import timed

POINTS, COLD, SAME_COST = 100, 30, 1e-6
PROBLEM = GaitProblem(
    robot=compass_biped(),
    sequence="stick | stick",
    friction=0.25,
    speed=0.6,
    step_length=0.47,
    limits=Limits(torque=6),
    objective="torque_squared",
    transcription=Collocation(intervals=40),
)


def test_a_branch_over_friction(benchmark, record):
    frictions = np.linspace(0.10, 0.25, POINTS)
    trace_optimum(PROBLEM, {"friction": (0.25, 0.24)}, options=OptimumOptions(points=2))  # compiles the NLP
    times = {"branch": [], "cold": [], "one start": []}
    branches, cold = [], {}

    def in_turn():
        seconds, _, diagram = timed(
            lambda: trace_optimum(PROBLEM, {"friction": (0.10, 0.25)}, options=OptimumOptions(points=POINTS))
        )
        times["branch"].append(seconds)
        branches.append(diagram.branches[0])
        for friction in frictions[len(branches) :: 10]:
            problem = PROBLEM.replace(friction=friction)
            seconds, _, gait = timed(lambda problem=problem: solve(problem, starts=8))
            times["cold"].append(seconds)
            cold[friction] = gait.solver.objective
            times["one start"].append(timed(lambda problem=problem: solve(problem))[0])

    benchmark.pedantic(in_turn, rounds=5)
    branch = branches[-1]
    costs = [branch.costs[np.argmin(np.abs(branch.values - friction))] for friction in cold]
    median = {name: statistics.median(values) for name, values in times.items()}
    numbers = {
        "branch_seconds": median["branch"],
        "cold_solves": median["branch"] / median["cold"],
        "single_starts": median["branch"] / median["one start"],
        "largest_difference": float(np.max(np.abs(np.array(costs) / list(cold.values()) - 1))),
        "special_points": len(branch.special),
    }
    record("optimal branch", numbers)
    print("\n" + ", ".join(f"{name} {value:.4g}" for name, value in numbers.items()))
    assert branch.passed.all()
    assert branch.values.size >= POINTS
    assert costs == pytest.approx(list(cold.values()), rel=SAME_COST)
    assert numbers["cold_solves"] < COLD
    assert numbers["single_starts"] < COLD
