"""Dask clusters: what two workers gain over one, and that deaths change nothing.

Run by ``pytest tests/benchmarks/test_cluster.py --benchmark-only -s``.  Targets: two workers do tasks of a second at
least 1.7 times as fast as one (they sleep: this is what the machinery costs, not what the machine has); a sweep of 200
gaits with a worker killed every ten seconds ends with the dataset of an undisturbed one.
"""

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

from gaitopt import DaskExecutor, Execution, load_sweep
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from tests import dask
from tests.parallel import works

ROOT = Path(__file__).parents[2]
ROUNDS, LEAST, TASKS, EVERY = 3, 1.7, 12, 10


def test_two_workers_against_one(benchmark, tmp_path):
    seconds = {1: [], 2: []}

    def in_turn():
        for count, times in seconds.items():
            folder = tmp_path / f"{count}-{len(times)}"
            folder.mkdir()
            with dask.scheduler(folder) as (address, _), dask.workers(address, count), DaskExecutor(address) as cluster:
                execution = Execution(executor=cluster)
                while cluster.count_workers() < count:
                    time.sleep(0.1)
                list(run_tasks(works.rest, [Task(str(i), 0.0) for i in range(4)], execution=execution))
                began = time.perf_counter()
                list(run_tasks(works.rest, [Task(str(i), 1.0) for i in range(TASKS)], execution=execution))
                times.append(time.perf_counter() - began)

    benchmark.pedantic(in_turn, rounds=ROUNDS)
    gains = [one / two for one, two in zip(seconds[1], seconds[2], strict=True)]
    figures = {"gain": statistics.median(gains), "least": min(gains), "most": max(gains)}
    benchmark.extra_info.update(figures)
    print("\n" + ", ".join(f"{name} {value:.4g}" for name, value in figures.items()))
    assert figures["gain"] >= LEAST


def run(path, *every):
    command = [sys.executable, "-m", "tests.benchmarks.cluster_sweep", path, *map(str, every)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout)


def test_a_sweep_whose_workers_are_killed(benchmark, tmp_path):
    ran = {}

    def both():
        ran["disturbed"] = run(tmp_path / "disturbed.nc", EVERY)
        ran["undisturbed"] = run(tmp_path / "undisturbed.nc")

    benchmark.pedantic(both, rounds=1)
    benchmark.extra_info.update(ran)
    print(f"\n{ran}")
    assert ran["disturbed"]["killed"] > 0
    assert load_sweep(tmp_path / "disturbed.nc").identical(load_sweep(tmp_path / "undisturbed.nc"))
