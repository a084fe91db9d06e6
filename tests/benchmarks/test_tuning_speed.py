"""Tuning two gains against closed-loop return maps: ``pytest tests/benchmarks --benchmark-only -s``."""

import time

import numpy as np
import pytest

from gaitopt import GainSearchOptions, compass_biped, load
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.tuning import controller_family_named
from gaitopt.tuning.gain_search import GainSearch
from gaitopt.tuning.tuning_objective import SpectralRadius

pytest.importorskip("heyoka")

MAPS = 500
"""Tuning two gains must take less time than this many return maps."""


def test_two_gains(benchmark):
    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    design = controller_family_named("pd", robot, gait.motion, torque_limit=8)
    design = design.with_bounds({"hip_stiffness": (0, 60), "hip_damping": (0, 20)})
    law = design.law({gain.name: gain.start for gain in design.gains})
    p, first = robot.vector(gait.motion.parameters), gait.motion.segments[0]
    section = Section(robot, p, sliding=True)
    returning = ReturnMap(Walker(robot, law, p, default_engine(law)), section)
    z = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    returning.derivative(z, returning(z))  # compiled
    began = time.perf_counter()
    for _ in range(50):
        returning(z)
    one = (time.perf_counter() - began) / 50

    def tune():
        task = GainSearch(gait, robot, design, SpectralRadius(), (), None, lambda step: None)
        return task.search(GainSearchOptions(samples=6, starts=1, evaluations=40, tolerance=1e-2)), len(task.trials)

    (best, count) = benchmark.pedantic(tune, rounds=3, iterations=1)
    ratio = benchmark.stats.stats.min / one
    print(
        f"\n{count} evaluations, radius {best.objective:.3f}: as long as {ratio:.0f} return maps of {1e3 * one:.2f} ms"
    )
    benchmark.extra_info.update(return_maps=ratio, radius=best.objective)
    assert ratio < MAPS
