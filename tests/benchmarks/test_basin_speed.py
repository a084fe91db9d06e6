"""Speed and memory of a basin, as ratios measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Targets, for 10,000 starts of 20 steps with friction events by two processes: at least half the throughput of a plain
process pool that walks the same steps by hand-written steps on bare heyoka, and less than 1 GB per process.  Wall
time counts the start of the processes; processor time is what a busy machine leaves comparable.
"""

import json
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("heyoka")

ROOT = Path(__file__).parents[2]
ROUNDS, MOST = 3, 2.0


def run(which):
    command = [sys.executable, "-m", "tests.benchmarks.basin_run", which]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout)


def test_basin(benchmark):
    runs = {"bare": [], "gaitopt": []}

    def in_turn():
        for which, answers in runs.items():
            answers.append(run(which))

    benchmark.pedantic(in_turn, rounds=ROUNDS)
    bare, own = runs["bare"][0], runs["gaitopt"][0]
    # Both walk the same steps; an error of 1e-15 grows a hundred million times in twenty steps along the basin's edge.
    assert own["each"] == bare["each"]
    np.testing.assert_allclose(own["angles"], bare["angles"], atol=1e-5)
    assert sum(steps == 20 for steps in own["each"]) > 0.85 * len(own["each"])
    pairs = list(zip(runs["gaitopt"], runs["bare"], strict=True))
    figures = {
        "bare_seconds": statistics.median(one["seconds"] for one in runs["bare"]),
        "gaitopt_seconds": statistics.median(one["seconds"] for one in runs["gaitopt"]),
        "steps_per_second": statistics.median(one["steps"] / one["seconds"] for one in runs["gaitopt"]),
        "wall_to_bare": statistics.median(one["seconds"] / other["seconds"] for one, other in pairs),
        "processor_to_bare": statistics.median(one["processor"] / other["processor"] for one, other in pairs),
        "megabytes": max(one["megabytes"] for one in runs["gaitopt"]),
    }
    benchmark.extra_info.update(figures)
    print("\n" + ", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in figures.items()))
    assert figures["processor_to_bare"] < MOST
    assert figures["wall_to_bare"] < MOST
    assert figures["megabytes"] < 1000
