"""Re-solves of gaits of several contacts from a gait at a friction 10 % away, against solves without a guess.

``pytest tests/benchmarks/test_planar_warm_start.py --benchmark-only -s``: two minutes, processor time.
"""

import time
from pathlib import Path

import numpy as np

from gaitopt import Status
from gaitopt.cli.script import read_script
from gaitopt.ocp import FromPlanarGait, solve_planar
from tests.ocp.multicontact_examples import stride

FOLDER = Path(__file__).parents[2] / "problems"
FRICTION = {"flat_foot": 1.0, "monopod": 1.0, "telescoping_biped": 1.0, "compass_double_support": 0.4}
FACTORS = (0.9, 1.1)


def examples():
    """Return the problems by name."""
    scripts = {name: read_script(FOLDER / f"{name}.py", [f"friction={mu}"])() for name, mu in FRICTION.items()}
    return {**scripts, "five links": stride()}


def timed(problem):
    """Return the gait of a problem and the processor time of its solve [s]."""
    begin = time.process_time()
    gait = solve_planar(problem)
    return gait, time.process_time() - begin


def compare(name, problem):
    """Return the ratios of the times of a problem; its NLPs are built before."""
    gait, ratios = solve_planar(problem), []
    for factor in FACTORS:
        other = problem.replace(friction=factor * problem.friction)
        (cold, seconds), (warm, again) = timed(other), timed(other.replace(guess=FromPlanarGait(gait)))
        ratios.append(again / seconds)
        counts = f"{warm.solver.iterations} of {cold.solver.iterations} iterations"
        print(f"\n{name}, friction {other.friction:.3g}: {ratios[-1]:.2f} of {seconds:.2f} s, {counts}")
        assert warm.status is cold.status is Status.SOLVED
        np.testing.assert_allclose(warm.solver.objective, cold.solver.objective, rtol=1e-6)
    return ratios


def test_a_gait_nearby_halves_the_time(benchmark):
    ratios = benchmark.pedantic(lambda: [compare(*one) for one in examples().items()], rounds=1)
    assert np.median(np.concatenate(ratios)) <= 0.5
