"""gaitopt beside other tools on one problem: ``pytest tests/benchmarks/test_other_tools.py --benchmark-only -s``.

Set OMP_NUM_THREADS=1, or idle threads of linear algebra count as work.  The sticking gait of 100 kg with the least
integral of squared torques, no limits on torque or friction, 20 intervals. Measured are building and the first
solve, imports excluded, and a solve at another speed that is warm-started from the first. Every tool is compared with
gaitopt on the coarsest grid on which its optimum is at least as accurate as the tool's.
"""

import functools
import importlib
import importlib.metadata
import math

import pytest

from gaitopt import Collocation, GaitProblem, Limits, WarmStart, compass_biped, solve
from gaitopt.ocp.nlp.block import derive_expressions
from tests.benchmarks.compass_equations import HIP, LEG, STEP
from tests.benchmarks.conftest import ratios, spread, timed
from tests.references.storage import reference

INTERVALS, FIRST, AGAIN = 20, 0.633, 0.7
ROUNDS = 7
TOOLS = {
    "CasADi, script tuned by hand": ("plain_tuned", "casadi", ROUNDS),
    "CasADi Opti, expanded": ("plain_opti", "casadi", ROUNDS),
    "rockit, expanded": ("plain_rockit", "rockit-meco", ROUNDS),
    "Drake DirectCollocation, IPOPT": ("plain_drake", "drake", ROUNDS),
    "nosnoc": ("plain_nosnoc", "nosnoc", ROUNDS),
    "dymos, SLSQP": ("plain_dymos", "dymos", 1),
}
CONVERGED = reference("compass_optimum", "torque_squared")["objective"]
"""Optimum of the continuous problem at the first speed, computed without gaitopt."""


def problem(robot, transcription, **changes):
    return GaitProblem(
        **{
            "robot": robot,
            "sequence": "stick | stick",
            "parameters": {"leg_mass": LEG, "hip_mass": HIP},
            "speed": FIRST,
            "step_length": STEP,
            "limits": Limits(torque=math.inf),
            "objective": "torque_squared",
            "transcription": transcription,
            **changes,
        }
    )


@functools.cache
def reference():
    """Return the optimum on a very fine grid."""
    gait = solve(problem(compass_biped(), Collocation(intervals=80, points=6)))
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(CONVERGED, rel=5e-7)
    return gait.solver.objective


@functools.cache
def grids():
    """Return gaitopt's errors on unrefined grids, coarse ones first."""
    found = []
    for points, counts in ((3, (4, 5, 6, 8, 10, 12, 16, 20, 24)), (4, (6, 8, 10, 12, 16, 20))):
        for count in counts:
            grid = Collocation(intervals=count, points=points, tolerance=math.inf)
            gait = solve(problem(compass_biped(), grid))
            found.append((count * (points - 1), gait.solver.objective / reference() - 1, grid))
    return sorted(found, key=lambda entry: entry[0])


class Own:
    """gaitopt with nothing compiled before, as a session of solves."""

    def __init__(self, grid):
        # A new robot shares only the derivatives of blocks with equal expressions, which are discarded here.
        derive_expressions.cache_clear()
        self.robot, self.grid = compass_biped.__wrapped__(), grid
        self.gait = None

    def solve(self, speed, *, continued=True):
        guess = WarmStart(self.gait) if continued and self.gait is not None else None
        self.gait = solve(problem(self.robot, self.grid, speed=speed, guess=guess))
        assert self.gait.status.ok
        return self.gait.solver.objective


def session(make):
    """Return (processor, clock) seconds of the first answer and of the one at another speed, and the first optimum."""
    first, first_clock, (walker, optimum) = timed(lambda: (lambda walker: (walker, walker.solve(FIRST)))(make()))
    again, again_clock, _ = timed(lambda: walker.solve(AGAIN))
    return (first, again), (first_clock, again_clock), optimum


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("tool", TOOLS)
def test_beside(benchmark, record, tool):
    module, package, rounds = TOOLS[tool]
    script = importlib.import_module(f"tests.benchmarks.{module}") if _installed(package) else None
    if script is None:
        pytest.skip(f"{package} is not installed")
    *_, optimum = session(lambda: script.Walker(INTERVALS))
    error = optimum / reference() - 1
    grid = next((grid for _, own, grid in grids() if own <= error), grids()[-1][2])
    makers = {
        "theirs": lambda: script.Walker(INTERVALS),
        "own": lambda: Own(grid),
        "default": lambda: Own(Collocation(intervals=INTERVALS)),
    }
    seconds, clocks, own_error = {name: [] for name in makers}, {name: [] for name in makers}, math.nan

    def turn():
        nonlocal own_error
        for name, make in makers.items():
            taken, clock, optimum = session(make)
            seconds[name].append(taken)
            clocks[name].append(clock)
            if name == "own":
                own_error = optimum / reference() - 1

    benchmark.pedantic(turn, rounds=rounds)
    numbers = {"error": error, "own_error": own_error, "grid": f"{grid.intervals} of {grid.points} points"}
    for i, what in enumerate(("first", "again")):
        for name in makers:
            numbers[f"{name}_{what}"] = spread([taken[i] for taken in seconds[name]])
            numbers[f"{name}_{what}_clock"] = spread([taken[i] for taken in clocks[name]])
        numbers[f"ratio_{what}"] = ratios(*([taken[i] for taken in seconds[name]] for name in ("own", "theirs")))
    record(f"beside {tool}", numbers, (package,))
    benchmark.extra_info.update(numbers)
    print(f"\n{tool}: error {error:.1e}; gaitopt with {numbers['grid']}, error {own_error:.1e}")
    for what in ("first", "again"):
        low, middle, high = numbers[f"ratio_{what}"]
        theirs, own, default = (numbers[f"{name}_{what}"][1] for name in ("theirs", "own", "default"))
        print(f"  {what}: {theirs:.4f} s, gaitopt {own:.4f} s (at its defaults {default:.4f} s); ", end="")
        print(f"ratio {middle:.2f} ({low:.2f} to {high:.2f})")
    assert own_error <= max(error, 1e-6)


def _installed(package):
    try:
        importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True
