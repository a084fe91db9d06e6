"""Time of a gait's multipliers, as a ratio measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Target: return map, exact derivative and eigenvalues within 10 times one simulated step, by the same engine.
"""

import statistics
import time

import numpy as np
import pytest

from gaitopt import ScipyEngine, compass_biped, passive, rimless_wheel
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

pytest.importorskip("heyoka")

from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine

MOST = 10.0
COMPASS, WHEEL = compass_biped(), rimless_wheel()
GAITS = {
    "A": (COMPASS, 1, 0.3, [-0.147836890, 0.732796791, -0.500667882, 0]),
    "B": (COMPASS, 1, 0.14, [-0.140807105, 0.710208797, -0.516847656, 0]),
    "C": (COMPASS, 1, 0.14, [-0.079038, 0.043777, -0.431761, 0.634174]),
    "wheel": (WHEEL, 13, 0.3, [0.88075 / np.sqrt(4 / 3 / 9.8), 0]),
}
ENGINES = {"heyoka": (HeyokaEngine(), 300), "scipy": (ScipyEngine(), 10)}


def seconds(work):
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("gait", GAITS)
def test_multipliers(benchmark, gait, engine):
    (robot, degrees, friction, z), (integrator, rounds) = GAITS[gait], ENGINES[engine]
    p, z = robot.vector(robot.resolve({"slope": np.deg2rad(degrees), "friction": friction})), np.array(z, dtype=float)
    walker = Walker(robot, passive(robot), p, integrator)
    returning = ReturnMap(walker, Section(robot, p, sliding=True))
    state, times = returning.section.embed(z), {"step": [], "multipliers": []}

    def in_turn():
        times["step"].append(seconds(lambda: walker.walk_step(state)))
        times["multipliers"].append(seconds(lambda: np.linalg.eigvals(returning.derivative(z, returning(z)))))

    benchmark.pedantic(in_turn, rounds=rounds, warmup_rounds=3)
    median = {name: statistics.median(values) for name, values in times.items()}
    ratio = median["multipliers"] / median["step"]
    benchmark.extra_info["ratio"] = ratio
    print(f"\nstep {1e6 * median['step']:.4g} us, multipliers {1e6 * median['multipliers']:.4g} us, ratio {ratio:.3g}")
    assert ratio < MOST
