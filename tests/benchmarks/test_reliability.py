"""Random feasible problems: how many are solved, and whether all that are reported solved pass their replay.

``pytest tests/benchmarks/test_reliability.py --benchmark-only -s`` takes about ten minutes on two cores.
"""

import concurrent.futures
import multiprocessing
import sys

import numpy as np

from gaitopt import GaitProblem, Limits, Status, compass_biped, solve, verify

PROBLEMS, SEED = 200, 11
SEQUENCES = ("stick | stick", "slip+ stick | slip+")


def random_problem(number):
    """Return a problem near the reference one: frictions 0.1 to 0.25, speeds and steps, masses, lengths and limits.

    Whether it is feasible is not known beforehand; torques are strong enough for nearly all of them to be.
    """
    rng = np.random.default_rng([SEED, number])
    length = 1.6 * rng.uniform(0.8, 1.2)
    parameters = {
        "leg_mass": rng.uniform(2, 6),
        "hip_mass": rng.uniform(0.5, 8),
        "leg_length": length,
        "leg_com": length * rng.uniform(0.35, 0.65),
    }
    return GaitProblem(
        robot=compass_biped(),
        sequence=SEQUENCES[number % len(SEQUENCES)],
        parameters=parameters if number % 4 > 1 else {},
        friction=rng.uniform(0.1, 0.25),
        speed=0.633 * rng.uniform(0.75, 1.25),
        step_length=0.4713 * rng.uniform(0.8, 1.2),
        limits=Limits(torque=rng.uniform(8, 20)),
    )


def outcome(number):
    """Return the number, how its solve ended, whether its replay passed, and the worst violation."""
    problem = random_problem(number)
    gait = solve(problem)
    passed = verify(gait).verification.passed if gait.status.ok else None
    worst = str(gait.solver.violations[0]) if gait.solver.violations else ""
    return number, gait.status, passed, gait.solver.solve_seconds, worst


def test_random_problems_are_solved_and_survive_replay(benchmark):
    def all_of_them():
        with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
            return list(pool.map(outcome, range(PROBLEMS), chunksize=4))

    results = benchmark.pedantic(all_of_them, rounds=1)
    solved = [number for number, status, passed, *_ in results if status is Status.SOLVED and passed]
    refuted = [number for number, status, passed, *_ in results if status is Status.SOLVED and not passed]
    seconds = [seconds for *_, seconds, _ in results]
    print(f"\n{len(solved)} of {PROBLEMS} solved and replayed; median {np.median(seconds):.2f} s", file=sys.stderr)
    for number, status, passed, _, worst in results:
        if number not in solved:
            print(f"problem {number}: {status.key}, replay {passed}, {worst}", file=sys.stderr)
    benchmark.extra_info.update(solved=len(solved), refuted=len(refuted))
    assert not refuted
    assert len(solved) >= 0.95 * PROBLEMS
