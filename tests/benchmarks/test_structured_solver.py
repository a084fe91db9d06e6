"""A solver that knows the stages of a problem.

``pytest tests/benchmarks/test_structured_solver.py --benchmark-only -s``: Ipopt with MUMPS and Fatrop on one programme,
laid out in stages by hand, from the same start.
"""

import sys

import pytest

from tests.benchmarks.plain_stages import Walker


@pytest.mark.parametrize("limited", [False, True], ids=["squared torques", "absolute work"])
@pytest.mark.parametrize("intervals", [20, 40, 80])
def test_stages(benchmark, intervals, limited):
    walkers = {plugin: Walker(plugin, intervals, limited=limited) for plugin in ("ipopt", "fatrop")}

    def alternately():
        return {name: min((w.solve() for _ in range(5)), key=lambda run: run[2]) for name, w in walkers.items()}

    found = benchmark.pedantic(alternately, rounds=1)
    for name, (cost, iterations, seconds, inside) in found.items():
        print(
            f"{intervals} intervals, {'absolute work' if limited else 'squared torques'}, {name}: {cost:.8f}, "
            f"{iterations} iterations, {1e3 * seconds:.1f} ms, {1e3 * inside:.1f} ms without the model",
            file=sys.stderr,
        )
    # Of absolute work there may be several optima; that of squared torques is one.
    assert found["ipopt"][0] == pytest.approx(found["fatrop"][0], rel=1e-2 if limited else 1e-6)
