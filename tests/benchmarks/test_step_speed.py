"""Speed of a passive step, as ratios measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Targets: the fast engine within 1.5 times a bare heyoka loop over the same phases, and at least 50 times as
fast as the scipy engine.  Two steps of the compass of Gamus & Or (2015) on a slope of one degree: Gait A never slips
at friction 0.3, Gait B is "slip+ stick slip- | stick" at 0.14.  The bare loop is Python floats all the way, so what the
walker does between phases weighs most where phases are many and the compiled code is fastest.
"""

import statistics
import subprocess
import sys
import time

import numpy as np
import pytest

from gaitopt import ScipyEngine, compass_biped, passive
from gaitopt.simulation.hybrid_automaton import Walker

pytest.importorskip("heyoka")

from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from tests.benchmarks import bare_heyoka

REPEATS, STEPS = 400, 5
MOST = 1.5
GAITS = {
    "A": (0.3, [0, 0, -0.147836890, -0.147836890, 0, 0, 0.732796791, -0.500667882]),
    "B": (0.14, [0, 0, -0.140807105, -0.140807105, 0, 0, 0.710208797, -0.516847656]),
}
HAND = [0, 2, 3, 4, 6, 7]  # entries of the state that the hand-written step has


def walker(engine, friction):
    robot = compass_biped()
    p = robot.vector(robot.resolve({"slope": bare_heyoka.SLOPE, "friction": friction}))
    return Walker(robot, passive(robot), p, engine)


def seconds(work, count):
    began = time.perf_counter()
    for _ in range(count):
        work()
    return (time.perf_counter() - began) / count


def report(benchmark, **figures):
    benchmark.extra_info.update(figures)
    print("\n" + ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in figures.items()))


@pytest.mark.parametrize("compact_mode", [True, False], ids=["compact", "full"])
@pytest.mark.parametrize("gait", GAITS)
def test_step(benchmark, gait, compact_mode):
    friction, state = GAITS[gait]
    state, hand = np.array(state), np.array(state)[HAND].tolist()
    bare = bare_heyoka.BareCompass(friction, compact_mode=compact_mode)
    fast, reference = (walker(e, friction) for e in (HeyokaEngine(compact_mode=compact_mode), ScipyEngine()))
    # All three walk the same walk_step.
    after = fast.walk_step(state).following
    np.testing.assert_allclose(bare.walk_step(hand)[0], after[HAND], atol=1e-11)
    np.testing.assert_allclose(reference.walk_step(state).following, after, atol=1e-10)

    times = {"bare": [], "fast": [], "scipy": []}

    def in_turn():
        times["bare"].append(seconds(lambda: bare.walk_step(hand), STEPS))
        times["fast"].append(seconds(lambda: fast.walk_step(state), STEPS))
        if len(times["fast"]) % 20 == 0:
            times["scipy"].append(seconds(lambda: reference.walk_step(state), 1))

    benchmark.pedantic(in_turn, rounds=REPEATS, warmup_rounds=20)
    median = {name: statistics.median(values) for name, values in times.items()}
    report(
        benchmark,
        **{f"{name}_microseconds": 1e6 * value for name, value in median.items()},
        to_bare=median["fast"] / median["bare"],
        scipy_to_fast=median["scipy"] / median["fast"],
    )
    assert median["scipy"] > 50 * median["fast"]
    assert median["fast"] < MOST * median["bare"]


BUILD = """
import sys, time
import heyoka
heyoka.llvm_state.set_diskcache_path(sys.argv[1])
from gaitopt import compass_biped, passive, Mode
from gaitopt.simulation.taylor.compiled_programs import program_with_events
robot = compass_biped()
control = passive(robot).control
began = time.perf_counter()
for mode in (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD):
    program_with_events(robot, mode, control, 1e-15, sys.argv[2] == "compact", 0)
print(time.perf_counter() - began)
"""


@pytest.mark.parametrize("compact_mode", ["compact", "full"])
def test_build(benchmark, compact_mode, tmp_path):
    """Three contact modes of the compass are compiled with an empty disk cache and with a full one."""

    def build():
        command = [sys.executable, "-c", BUILD, str(tmp_path), compact_mode]
        return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    first = build()
    again = benchmark.pedantic(build, rounds=3)
    report(benchmark, first_seconds=first, again_seconds=again)
    assert again < first
