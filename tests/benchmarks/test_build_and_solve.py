"""Speed and memory, as ratios measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Targets: build + solve within 1.5 times a plain CasADi script of the same programme, import below 0.5 s,
peak memory of the default solve below 500 MB.
"""

import math
import statistics
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, solve
from gaitopt.ocp.nlp import ipopt
from gaitopt.ocp.nlp.block import derive_expressions
from gaitopt.ocp.solution import trajectory
from gaitopt.ocp.transcription.transcription import transcribe
from tests.benchmarks import plain_casadi

ROOT = Path(__file__).parents[2]
REPEATS = 9


def problem(friction=plain_casadi.FRICTION, **grid):
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=friction,
        speed=plain_casadi.SPEED,
        step_length=plain_casadi.STEP,
        limits=Limits(torque=plain_casadi.TORQUE),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=20, **grid),
    )


def forget():
    """Empty every cache of what was built for a problem."""
    for cached in (transcribe, derive_expressions, ipopt._compile, trajectory._build_integrator):
        cached.cache_clear()


def timed(work):
    """Return the seconds some work takes, and its result."""
    began = time.perf_counter()
    result = work()
    return time.perf_counter() - began, result


def report(benchmark, **figures):
    benchmark.extra_info.update(figures)
    print("\n" + ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in figures.items()))


def compare(benchmark, **grid):
    """Measure gaitopt with fresh caches and the plain script in turn; return median times and both last answers."""
    times, answers = {"plain": [], "own": []}, {}

    def both():
        seconds, answers["plain"] = timed(plain_casadi.solve)
        times["plain"].append(seconds)
        forget()
        seconds, answers["own"] = timed(lambda: solve(problem(**grid)))
        times["own"].append(seconds)

    benchmark.pedantic(both, rounds=REPEATS, warmup_rounds=1)
    return {name: statistics.median(values[1:]) for name, values in times.items()}, answers


def test_build_and_solve_of_the_same_programme(benchmark):
    # No refinement of the integration: two Runge-Kutta steps per interval, as in the plain script.
    times, answers = compare(benchmark, tolerance=math.inf)
    own, (optimum, iterations, *_) = answers["own"], answers["plain"]
    ratio = times["own"] / times["plain"]
    report(benchmark, plain_seconds=times["plain"], gaitopt_seconds=times["own"], ratio=ratio)
    assert own.status.ok
    assert own.solver.objective == pytest.approx(optimum, rel=1e-6)
    assert own.solver.iterations <= 1.5 * iterations
    assert ratio <= 1.5


def test_build_and_solve_with_refinement(benchmark):
    """For the record: at its default tolerance gaitopt refines this coarse grid, which the plain script does not."""
    times, answers = compare(benchmark)
    own, optimum = answers["own"], answers["plain"][0]
    ratio = times["own"] / times["plain"]
    report(benchmark, gaitopt_seconds=times["own"], ratio=ratio, iterations=own.solver.iterations)
    assert own.solver.objective == pytest.approx(optimum, rel=1e-5)


def test_a_second_solve_with_another_friction(benchmark):
    forget()
    first, began = timed(lambda: solve(problem(tolerance=math.inf)))
    assert began.solver.build_seconds > 0
    built = transcribe.cache_info().misses, ipopt._compile.cache_info().misses
    times = []

    def again():
        seconds, gait = timed(lambda: solve(problem(friction=0.16, tolerance=math.inf)))
        assert gait.status.ok
        assert gait.solver.build_seconds == 0
        times.append(seconds)

    benchmark.pedantic(again, rounds=REPEATS)
    assert (transcribe.cache_info().misses, ipopt._compile.cache_info().misses) == built
    report(benchmark, first_seconds=first, again_seconds=statistics.median(times))
    assert statistics.median(times) < first


def test_import_time(benchmark):
    """Of a whole interpreter that imports gaitopt, less one that imports nothing."""

    def interpreter(code):
        return timed(lambda: subprocess.run([sys.executable, "-c", code], check=True))[0]

    times = {"pass": [], "import gaitopt": []}

    def both():
        for code, seconds in times.items():
            seconds.append(interpreter(code))

    benchmark.pedantic(both, rounds=REPEATS, warmup_rounds=1)
    cost = statistics.median(times["import gaitopt"]) - statistics.median(times["pass"])
    report(benchmark, import_seconds=cost)
    assert cost < 0.5


MEMORY = """
import resource, sys
from gaitopt.cli.app import main
try:
    main(["solve", sys.argv[1], "--quiet", "-o", sys.argv[2]])
except SystemExit as stop:
    assert not stop.code, stop.code
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


@pytest.mark.parametrize("script", ["compass_slip", "compass_stick"])
def test_peak_memory_of_the_default_solve(benchmark, tmp_path, script):
    arguments = [ROOT / f"problems/{script}.py", tmp_path / "gait.h5"]

    def run():
        return subprocess.run([sys.executable, "-c", MEMORY, *arguments], check=True, capture_output=True, text=True)

    peak = float(benchmark.pedantic(run, rounds=1).stdout)
    report(benchmark, peak_megabytes=peak)
    assert 10 < peak < 500
