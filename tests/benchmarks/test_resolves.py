"""Repeated solves of the cost of transport: ``pytest tests/benchmarks/test_resolves.py --benchmark-only -s``.

Set OMP_NUM_THREADS=1.  A gait at friction 0.14, with 40 intervals, is the start of one at 0.15.  Its time is compared
with that of a cold solve, and for the sticking gait with those of other tools that split the joint powers as well.
gaitopt splits them at three points per interval; the script for Opti at two, and that for rockit at one.  Their numbers
of intervals are 40, and those with which as many powers are split.
"""

import importlib
import importlib.metadata
import inspect

import pytest

from gaitopt import Collocation, GaitProblem, Limits, WarmStart, compass_biped, solve
from tests.benchmarks.conftest import ratios, spread, timed

STICK, SLIP = "stick | stick", "slip+ stick | slip+"
BEFORE, AFTER, INTERVALS, ROUNDS = 0.14, 0.15, 40, 5
TOOLS = {"CasADi Opti": ("plain_opti_work", "casadi", 60), "rockit": ("plain_rockit_work", "rockit-meco", 120)}


def problem(robot, sequence, friction, **changes):
    return GaitProblem(
        robot=robot,
        sequence=sequence,
        friction=friction,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        transcription=Collocation(intervals=INTERVALS),
        **changes,
    )


def measure(sequence):
    """Return the seconds of a first solve, of one with everything compiled, and of one from a gait nearby."""
    robot = inspect.unwrap(compass_biped)()  # what is compiled belongs to a robot: nothing is known of a new one
    first, _, gait = timed(lambda: solve(problem(robot, sequence, BEFORE)))
    solve(problem(robot, sequence, AFTER, guess=WarmStart(gait)))
    cold, _, other = timed(lambda: solve(problem(robot, sequence, AFTER)))
    again, _, near = timed(lambda: solve(problem(robot, sequence, AFTER, guess=WarmStart(gait))))
    assert near.status.ok
    assert near.solver.objective <= other.solver.objective * (1 + 1e-6)
    return first, cold, again


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_a_repeated_solve_takes_a_third_of_a_cold_one(benchmark, record, sequence):
    seconds = []
    benchmark.pedantic(lambda: seconds.append(measure(sequence)), rounds=ROUNDS, warmup_rounds=1)
    first, cold, again = zip(*seconds[1:], strict=True)
    numbers = {"first": spread(first), "cold": spread(cold), "again": spread(again)}
    numbers |= {"ratio_first": ratios(again, first), "ratio_cold": ratios(again, cold)}
    record(f"repeated solve, {sequence}", numbers)
    print(f"\n{sequence}: first {numbers['first'][1]:.3f} s, compiled {numbers['cold'][1]:.3f} s, ", end="")
    print(f"again {numbers['again'][1]:.3f} s; ratios {numbers['ratio_first'][1]:.2f}, {numbers['ratio_cold'][1]:.2f}")
    assert numbers["ratio_first"][1] <= 0.3


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("equal", ["intervals", "slacks"])
@pytest.mark.parametrize("tool", TOOLS)
def test_a_repeated_solve_beside_another_tool(benchmark, record, tool, equal):
    module, package, count = TOOLS[tool]
    intervals = INTERVALS if equal == "intervals" else count
    try:
        importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{package} is not installed")
    walker, robot = importlib.import_module(f"tests.benchmarks.{module}").Walker(intervals), compass_biped()
    gait = solve(problem(robot, STICK, BEFORE))
    own, theirs, costs = [], [], {}

    def once():
        costs.update({friction: walker.solve(friction) for friction in (AFTER, BEFORE)})
        theirs.append(timed(lambda: walker.solve(AFTER))[0])
        own.append(timed(lambda: solve(problem(robot, STICK, AFTER, guess=WarmStart(gait))))[0])

    benchmark.pedantic(once, rounds=ROUNDS, warmup_rounds=1)
    numbers = {"own": spread(own[1:]), "theirs": spread(theirs[1:]), "ratio": ratios(own[1:], theirs[1:])}
    numbers |= {"cost": costs[BEFORE], "intervals": intervals}
    record(f"repeated solve beside {tool}, equal {equal}", numbers, (package,))
    theirs, own, ratio = (numbers[name][1] for name in ("theirs", "own", "ratio"))
    print(f"\n{tool}, {intervals} intervals, cost {costs[BEFORE]:.6f}: {theirs:.3f} s, ", end="")
    print(f"gaitopt {own:.3f} s, ratio {ratio:.2f}")
    assert equal == "intervals" or ratio < 1
