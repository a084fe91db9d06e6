"""The five-link walker of RABBIT's size, friction 0.2, slipping touchdown, beside a plain Opti script of the same NLP.

``pytest tests/benchmarks/test_five_link_opti.py --benchmark-only -s``: a minute.  Both derive, build and solve; caches
are emptied before every run.
"""

import numpy as np
import pytest

from gaitopt import Collocation
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact.planar_guess import find_poses
from gaitopt.ocp.multicontact.planar_start import setting_of
from gaitopt.ocp.nlp.block import derive_expressions
from tests.benchmarks import plain_five_link_opti
from tests.benchmarks.conftest import ratios, spread, timed
from tests.ocp.multicontact_examples import stride

INTERVALS, ROUNDS = 12, 5


def problem(**method):
    """Return the problem with a new robot, whose equations are not known from an earlier run."""
    method = Collocation(intervals=INTERVALS, **method)
    return stride(friction=0.2, transcription=method).replace(sequence="slip+ stick | slip+")


def solve_own(**method):
    derive_expressions.cache_clear()
    return solve_planar(problem(**method))


def solve_plain(points, start):
    gait = plain_five_link_opti.Gait(INTERVALS, points, friction=0.2, speed=0.7, step=0.4)
    return gait.opti.nx, *gait.solve(*start)


def test_build_and_solve_beside_a_plain_script(benchmark, record):
    """One NLP of four points, and at default accuracy all grids beside the last one alone, of six points."""
    guess = problem()
    start = (*find_poses(setting_of(guess)), guess.guess.durations(setting_of(guess)))
    cases = {"one grid": (4, {"tolerance": np.inf}), "default accuracy": (6, {})}
    times, answers = {name: {"own": [], "plain": []} for name in cases}, {}

    def once():
        for name, (points, method) in cases.items():
            own, _, gait = timed(lambda method=method: solve_own(**method))
            plain, _, answer = timed(lambda points=points: solve_plain(points, start))
            times[name]["own"].append(own)
            times[name]["plain"].append(plain)
            answers[name] = gait, answer

    benchmark.pedantic(once, rounds=ROUNDS, warmup_rounds=1)
    for name, seconds in times.items():
        gait, (unknowns, optimum, iterations) = answers[name]
        ratio = ratios(seconds["own"], seconds["plain"])
        numbers = {"own": spread(seconds["own"]), "plain": spread(seconds["plain"]), "ratio": ratio}
        counts = {"own iterations": gait.solver.iterations, "plain iterations": iterations}
        record(f"five links beside Opti, {name}", numbers | counts)
        print(f"\n{name}: {numbers['own'][1]:.2f} s, plain {numbers['plain'][1]:.2f} s, ratio {ratio[1]:.2f}, {counts}")
        assert gait.status.ok
        assert sum(table.values.size for table in gait.solution.unknowns.values()) == unknowns
        assert gait.solver.objective == pytest.approx(optimum, rel=1e-8)
        assert ratio[1] < 1
