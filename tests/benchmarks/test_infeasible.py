"""Infeasible random problems: the time to report them, and whether the limits that are named really conflict.

A named limit is confirmed if the problem is solved without it.  Run with ``pytest tests/benchmarks/test_infeasible.py``.
"""

import math
import sys

import numpy as np

from gaitopt import GaitProblem, Limits, Margins, Status, compass_biped, solve
from tests.benchmarks.conftest import timed

INFEASIBLE, SOLVED, SEED = 30, 20, 5
SEQUENCES = ("stick | stick", "slip+ stick | slip+", "slip+ stick | stick")
OBJECTIVES = ("cost_of_transport", "torque_squared")
MOST_DRAWS = 200


def random_problem(number, kind):
    """Return a random compass problem: ``"solvable"``, ``"torque"``, ``"step"`` or ``"speed"`` too demanding."""
    rng = np.random.default_rng([SEED, number])
    length = 1.6 * rng.uniform(0.8, 1.2)
    parameters = {
        "leg_mass": rng.uniform(2, 6),
        "hip_mass": rng.uniform(0.5, 8),
        "leg_length": length,
        "leg_com": length * rng.uniform(0.35, 0.65),
    }
    friction, torque = rng.uniform(0.1, 0.25), rng.uniform(8, 20)
    speed, step = 0.633 * rng.uniform(0.75, 1.25), 0.4713 * rng.uniform(0.8, 1.2)
    strength = rng.uniform(0.02, 0.1) if kind == "torque" else 1.0
    friction *= rng.uniform(0.2, 0.5) if kind == "step" else 1.0
    step *= rng.uniform(1.6, 2.6) if kind == "step" else 1.0
    speed *= rng.uniform(2.5, 6) if kind == "speed" else 1.0
    return GaitProblem(
        robot=compass_biped(),
        sequence=SEQUENCES[number % len(SEQUENCES)],
        parameters=parameters,
        friction=friction,
        speed=speed,
        step_length=step,
        limits=Limits(torque=strength * torque),
        objective=OBJECTIVES[number // len(SEQUENCES) % len(OBJECTIVES)],
    )


def without(problem, conflicts):
    """Return a problem without some of its limits, or None for a condition of its contact sequence."""
    for conflict in conflicts:
        if conflict.setting in ("speed", "step_length"):
            problem = problem.replace(**{conflict.setting: None})
        elif conflict.setting == "Limits.torque":
            actuator = conflict.name.removeprefix("torque limit of ")
            torques = dict(zip(problem.robot.actuators, problem.limits.torques(problem.robot.actuators), strict=True))
            problem = problem.replace(limits=Limits(torque={**torques, actuator: math.inf}))
        elif conflict.setting == "friction":
            problem = problem.replace(friction=math.inf if problem.sequence == "stick | stick" else 10.0)
        elif conflict.setting.startswith("Margins.") and not math.isnan(conflict.sufficient):
            problem = problem.replace(margins=Margins(**{conflict.setting.removeprefix("Margins."): 0.0}))
        else:
            return None
    return problem


def is_confirmed(problem, gait):
    """Return whether the problem is solved without each limit that is enough alone, or without all of them."""
    conflicts = gait.solver.conflicts
    if not conflicts:
        return False
    groups = [[conflict] for conflict in conflicts] if conflicts[0].separable else [conflicts]
    relaxed = [without(problem, group) for group in groups]
    return all(other is not None and solve(other).status.ok for other in relaxed)


def measure():
    """Return the seconds of solved problems, and of infeasible ones with their statuses and confirmations."""
    solve(random_problem(0, "solvable"))  # the first call imports
    seconds, infeasible, number = [], [], 0
    while len(seconds) < SOLVED and number < MOST_DRAWS:
        cpu, _, gait = timed(lambda: solve(random_problem(number, "solvable")))  # noqa: B023
        seconds += [cpu] if gait.status.ok else []
        number += 1
    number = 0
    while len(infeasible) < INFEASIBLE and number < MOST_DRAWS:
        kind = ("torque", "step", "speed")[number // 2 % 3]
        problem = random_problem(number, kind)
        cpu, _, gait = timed(lambda: solve(problem))  # noqa: B023
        if not gait.status.ok:
            confirmed = is_confirmed(problem, gait)
            infeasible.append((cpu, gait.status, confirmed))
            names = "; ".join(map(str, gait.solver.conflicts))
            line = f"{number} {kind} {problem.sequence} {problem.objective.name}: {gait.status.key}, {cpu:.2f} s"
            print(f"{line}, confirmed {confirmed}, {gait.solver.message}: {names}", file=sys.stderr, flush=True)
        number += 1
    return seconds, infeasible


def test_infeasible_problems_are_reported_quickly_with_the_limits_that_conflict(benchmark):
    seconds, infeasible = benchmark.pedantic(measure, rounds=1)
    ratios = np.array([cpu for cpu, *_ in infeasible]) / np.median(seconds)
    named = sum(confirmed for *_, confirmed in infeasible)
    stated = sum(status is Status.INFEASIBLE for _, status, _ in infeasible)
    within = int(np.sum(ratios <= 5))
    quartiles = ", ".join(f"{ratio:.1f}" for ratio in np.quantile(ratios, (0.5, 0.9, 1.0)))
    print(
        f"\nmedian of {len(seconds)} solved: {np.median(seconds):.2f} s; {len(infeasible)} infeasible: {stated} reported "
        f"as such, {within} within 5 times the median (median, 90 %, largest ratio {quartiles}), {named} confirmed",
        file=sys.stderr,
    )
    benchmark.extra_info.update(within=within, named=named)
    assert within >= 0.95 * len(infeasible)
    assert named >= 0.9 * len(infeasible)
