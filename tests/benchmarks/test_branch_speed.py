"""Speed of a branch, as a ratio measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Target: a trace of 200 points takes at most 3 times the processor time of Newton's method at its points, each started
from the point before; the trace also computes tangents and derivatives by the parameter, and looks for special points.
"""

import math
import statistics
import time

import pytest

from gaitopt import WalkProblem, compass_biped, trace
from gaitopt.continuation import ArclengthOptions, TraceOptions
from gaitopt.continuation.gait_source import make_gait_source
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle_iteration import search_section
from gaitopt.stability.fixed_point import find_fixed_point
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.return_map import ReturnMap

pytest.importorskip("heyoka")

ENDS = (math.radians(1), math.radians(4.3))
GOSWAMI = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81, "friction": math.inf}
OPTIONS = TraceOptions(arclength=ArclengthOptions(longest_step=0.007))
ROUNDS, MOST = 3, 3.0


def solve_each(family, branch):
    """Solve for each gait of a branch from the gait before it."""
    for before, value in zip(branch.states[:-1], branch.values[1:], strict=True):
        robot = family.robot
        p = robot.vector(robot.resolve(GOSWAMI | {"slope": float(value)}))
        walker = Walker(robot, family.law, p, family.engine, step_limits=StepLimits(duration=10.0))
        return_map = ReturnMap(walker, search_section(walker), 1, Linearisation(walker))
        assert find_fixed_point(return_map, before) is not None


def test_branch(benchmark):
    problem = WalkProblem(robot=compass_biped(), parameters=GOSWAMI)
    source = make_gait_source(problem, {"slope": ENDS})
    start = source.search(ENDS[0], 8)[0]
    family, ratios, points = source.start(start).family, [], []

    def in_turn():
        begin = time.process_time()
        (branch,) = trace(problem, {"slope": ENDS}, start=start, options=OPTIONS).branches
        middle = time.process_time()
        solve_each(family, branch)
        ratios.append((middle - begin) / (time.process_time() - middle))
        points.append(branch.values.size)

    in_turn()  # which compiles the equations
    ratios.clear()
    benchmark.pedantic(in_turn, rounds=ROUNDS)
    ratio = statistics.median(ratios)
    benchmark.extra_info.update(ratio=ratio, points=points[-1])
    print(f"\npoints {points[-1]}, processor time to that of Newton's method {ratio:.3g}")
    assert points[-1] >= 200
    assert ratio <= MOST
