"""A walker of five links, slipping at touchdown: solved, replayed, and held by feedback through its slip.

``pytest tests/benchmarks/test_five_link.py --benchmark-only -s``: half a minute.
"""

from pathlib import Path

import numpy as np

from gaitopt import assess_stability, check_robot, lqr, solve, verify
from gaitopt.cli.script import build_problem

SCRIPT = Path(__file__).parents[2] / "problems" / "five_link.py"


def test_the_five_link_walker_is_planned_and_held(benchmark):
    problem = build_problem(SCRIPT, [])
    assert check_robot(problem.robot).passed
    gait = benchmark.pedantic(lambda: verify(solve(problem)), rounds=1)
    assert gait.verification.passed, gait.verification.reasons
    assert str(gait.motion.sequence()) == "slip+ stick | slip+"

    alone = assess_stability(gait)
    held = assess_stability(gait, lqr(problem.robot, gait.motion, torque_limit=100))
    print(f"\nlargest multiplier {alone.radius:.3g} with its torques played back, {held.radius:.3g} under feedback")
    assert alone.radius > 1e5
    assert held.radius < 0.5
    np.testing.assert_allclose(held.z, alone.z, atol=1e-6)


def test_multiple_shooting_finds_the_same_gait(benchmark):
    """Some five minutes: errors grow 50 000 times within a step, and shooting takes many steps to follow it."""
    problem, other = (
        build_problem(SCRIPT, ["sequence=stick | stick", "intervals=40", f"transcription={method}"])
        for method in ("multiple_shooting", "collocation")
    )
    gait = benchmark.pedantic(lambda: verify(solve(problem)), rounds=1)
    assert gait.verification.passed, gait.verification.reasons
    np.testing.assert_allclose(gait.cost_of_transport, solve(other).cost_of_transport, rtol=1e-3)
