"""What grids, contact sequences and sweeps cost: ``pytest tests/benchmarks/test_growth.py --benchmark-only -s``."""

import functools
import math

import numpy as np
import pytest

from gaitopt import Collocation, Execution, GaitProblem, Ipopt, Limits, MultipleShooting, compass_biped, solve, sweep
from gaitopt.ocp.nlp.block import derive_expressions
from gaitopt.ocp.solution.grid_solve import BARRIER_SAME_PROBLEM, SingleStart
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.progress import silent
from tests.benchmarks.conftest import ratios, spread, timed

STICK, SLIP = "stick | stick", "slip+ stick | slip+"
METHODS = {"collocation": Collocation, "shooting": MultipleShooting}
ROUNDS = 5


def problem(**changes):
    return GaitProblem(
        **{
            "robot": compass_biped(),
            "sequence": STICK,
            "friction": 0.14,
            "speed": 0.633,
            "step_length": 0.4713,
            "limits": Limits(torque=6),
            **changes,
        }
    )


@pytest.mark.parametrize("name", METHODS)
def test_time_per_iteration_is_linear_in_the_grid(benchmark, record, name):
    counts, seconds = (20, 40, 80, 160, 320), {}
    methods = [METHODS[name](intervals=count, tolerance=math.inf) for count in counts]

    def once():
        for count, method in zip(counts, methods, strict=True):
            smooth = problem(objective="torque_squared", transcription=method)
            start = SingleStart(smooth, LinearGuess(), Ipopt(), silent)
            taken, _, step = timed(
                lambda start=start, method=method: start.solve_on_grid(method, None, BARRIER_SAME_PROBLEM)
            )
            if start.build_seconds == 0:
                seconds.setdefault(count, []).append(taken / step.outcome.iterations)

    benchmark.pedantic(once, rounds=ROUNDS, warmup_rounds=1)
    least = [min(seconds[count]) for count in counts]  # what other users of the machine take only adds
    exponent = float(np.polyfit(np.log(counts), np.log(least), 1)[0])
    record(f"iteration, {name}", {"seconds": dict(zip(counts, least, strict=True)), "exponent": exponent})
    print(f"\n{name}: ms per iteration {[round(1e3 * value, 2) for value in least]}, exponent {exponent:.2f}")
    assert exponent <= 1.1


def test_build_of_the_slip_sequence(benchmark, record):
    seconds = {STICK: [], SLIP: []}

    def once():
        robot = compass_biped.__wrapped__()  # a new robot shares only the derivatives of equal blocks
        for sequence, taken in seconds.items():
            derive_expressions.cache_clear()
            start = SingleStart(problem(robot=robot, sequence=sequence), LinearGuess(), Ipopt(max_iterations=0), silent)
            taken.append(
                timed(lambda start=start: start.solve_on_grid(start.problem.transcription, None, BARRIER_SAME_PROBLEM))[
                    0
                ]
            )

    benchmark.pedantic(once, rounds=ROUNDS, warmup_rounds=1)
    ratio = ratios(seconds[SLIP], seconds[STICK])
    record("build", {"stick": spread(seconds[STICK]), "slip": spread(seconds[SLIP]), "ratio": ratio})
    print(f"\nbuild of {SLIP!r} / {STICK!r}: {ratio[1]:.2f} ({ratio[0]:.2f} to {ratio[2]:.2f})")
    assert ratio[1] <= 2


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_costs_converge_with_the_grid(benchmark, record, sequence):
    table = {name: {} for name in METHODS}

    def once():
        for name, method in METHODS.items():
            for count in (10, 20, 40, 80):
                gait = solve(problem(sequence=sequence, transcription=method(intervals=count)))
                assert gait.status.ok
                table[name][count] = gait.solver.objective, gait.problem["intervals"]

    benchmark.pedantic(once, rounds=1)
    record(f"convergence, {sequence}", table)
    print(f"\n{sequence}")
    for name, values in table.items():
        print(f"{name}: " + ", ".join(f"{count}: {cost:.8f} {grid}" for count, (cost, grid) in values.items()))
    left, right = (table[name][40][0] for name in METHODS)
    assert left == pytest.approx(right, rel=1e-3)


def test_sweep(benchmark, record):
    """26 frictions and two contact sequences against 28 times one cold solve, and two workers against one."""
    frictions = np.linspace(0.1, 0.25, 26)
    found = {"cold": [], "one worker": [], "two workers": []}

    def once():
        for friction in (0.12, 0.16, 0.2):
            for sequence in (STICK, SLIP):
                derive_expressions.cache_clear()
                alone = problem(robot=compass_biped.__wrapped__(), sequence=sequence, friction=friction)
                found["cold"].append(timed(functools.partial(solve, alone))[1])
        for name, workers in (("one worker", 1), ("two workers", 2)):
            execution = Execution(workers=workers)
            work = functools.partial(
                sweep, problem(), {"friction": frictions}, sequences=[STICK, SLIP], execution=execution
            )
            _, clock, points = timed(work)
            found[name].append(clock)
            found["solved"] = int((points.status == "solved").sum())

    # Packages are imported and the simulator is compiled before, as in the single solves.
    sweep(problem(), {"friction": frictions[:1]}, sequences=[STICK], execution=Execution(workers=1))
    benchmark.pedantic(once, rounds=1)
    cold, one, two = float(np.median(found["cold"])), found["one worker"][0], found["two workers"][0]
    numbers = {"cold": cold, "one": one, "two": two, "solved": found["solved"]}
    record("sweep", {**numbers, "solves": one / cold, "speed_up": one / two})
    print(f"\nsweep of 52: {one:.1f} s, {one / cold:.1f} cold solves of {cold:.2f} s")
    print(f"two workers: {one / two:.2f} times as fast")
    assert one <= 28 * cold
