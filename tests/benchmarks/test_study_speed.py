"""Studies: speed as ratios measured in one run, and sweeps killed again and again.

``pytest tests/benchmarks/test_study_speed.py --benchmark-only -s``.  Targets: a 26-point friction sweep of two
sequences at most 28 cold solves, two workers at least 1.7 times one, a search in about a minute.  The machine must have
two idle cores.
"""

import random
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from gaitopt import Execution, GaitProblem, Limits, compass_biped, search, sweep
from gaitopt.study.storage.gait_store import GaitStore
from tests.benchmarks.test_build_and_solve import report
from tests.study.conftest import quick_problem

SEQUENCES = ["stick | stick", "slip+ stick | slip+"]
COLD = """
import sys, time
from tests.benchmarks.test_study_speed import walker
from gaitopt import solve
problem = walker(sys.argv[1])
began = time.perf_counter()
assert solve(problem).status.ok
print(time.perf_counter() - began)
"""


def walker(sequence=SEQUENCES[0], friction=0.14):
    return GaitProblem(
        robot=compass_biped(),
        sequence=sequence,
        friction=friction,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
    )


def cold_seconds(sequence):
    """Return the seconds of a first solve in a new process."""
    done = subprocess.run([sys.executable, "-c", COLD, sequence], check=True, capture_output=True, text=True)
    return float(done.stdout)


def test_frontier_in_cold_solves_and_two_workers(benchmark):
    cold = np.mean([np.median([cold_seconds(sequence) for _ in range(3)]) for sequence in SEQUENCES])
    friction, seconds = np.linspace(0.1, 0.25, 26), {}

    def frontiers():
        for workers in (1, 2):
            began = time.perf_counter()
            table = sweep(walker(), {"friction": friction}, sequences=SEQUENCES, execution=Execution(workers=workers))
            seconds[workers] = time.perf_counter() - began
            assert table.verified.all()

    benchmark.pedantic(frontiers, rounds=1)
    ratios = {f"cold_solves_with_{workers}": seconds[workers] / cold for workers in seconds}
    report(benchmark, cold_seconds=cold, **ratios, two_workers_gain=seconds[1] / seconds[2])
    assert ratios["cold_solves_with_2"] <= 28
    assert seconds[1] / seconds[2] > 1.7


@pytest.mark.parametrize("friction", [0.1, 0.12, 0.14, 0.17, 0.2, 0.23, 0.25])
def test_search_finds_the_best_sequence_in_about_a_minute(benchmark, friction):
    """The cost exceeds that of no contact sequence solved separately by more than 0.1 %."""
    ranking = benchmark.pedantic(lambda: search(walker(friction=friction), execution=Execution(workers=2)), rounds=1)
    seconds = benchmark.stats.stats.max
    sequences = [*SEQUENCES, "stick slip- | stick", "slip+ stick slip- | slip+"]
    alone = sweep(walker(), {"friction": [friction]}, sequences=sequences, execution=Execution(workers=2))
    assert ranking.best.cost_of_transport <= 1.001 * float(alone.cost_of_transport.min())
    assert all(finding.gait.verification.passed for finding in ranking.findings if finding.ranked)
    report(benchmark, friction=friction, seconds=seconds, cost=ranking.best.cost_of_transport)
    print(ranking.best.sequence)
    assert seconds < 75


KILLED = """
    import sys
    import numpy as np
    from gaitopt import Execution, sweep
    from tests.study.conftest import quick_problem

    if __name__ == "__main__":
        show = lambda done, total: print(done, flush=True)
        sweep(quick_problem(), {{'friction': np.linspace(0.13, 0.19, 24)}}, sequences={sequences}, starts=1,
              path=sys.argv[1], execution=Execution(workers=2, observer=show))
"""


def test_twenty_kills_lose_nothing_that_was_finished(benchmark, tmp_path):
    whole = sweep(
        quick_problem(),
        {"friction": np.linspace(0.13, 0.19, 24)},
        sequences=SEQUENCES,
        starts=1,
        execution=Execution(workers=2),
    )
    script, path, moments = tmp_path / "killed.py", tmp_path / "frontier.nc", random.Random(20)
    script.write_text(textwrap.dedent(KILLED).format(sequences=SEQUENCES))
    kills = 0

    def to_the_end():
        nonlocal kills
        while True:
            process = subprocess.Popen([sys.executable, script, path], stdout=subprocess.PIPE, text=True)
            if kills < 20:
                process.stdout.readline()  # the first result of this run
                time.sleep(moments.uniform(0, 0.6))
                process.send_signal(signal.SIGKILL)
                kills += 1
            told = process.communicate()[0].split()
            if process.returncode == 0:
                return
            assert process.returncode == -signal.SIGKILL
            kept = len(list(Path(GaitStore.beside(path)).glob("[!.]*.h5")))
            assert not told or kept >= int(told[-1])

    benchmark.pedantic(to_the_end, rounds=1)
    table = sweep(quick_problem(), {"friction": np.linspace(0.13, 0.19, 24)}, sequences=SEQUENCES, starts=1, path=path)
    report(benchmark, kills=kills)
    assert kills == 20
    assert table.identical(whole)
