"""Sixty infeasible design problems: whether the limits that are named are a smallest conflicting set.

``python -m tests.benchmarks.infeasible_designs`` solves every problem with the default options, changes the limits that
are named, solves and verifies again, and writes ``docs/infeasible_designs.json`` and the page
``docs/infeasible_designs.md``.  Every problem is stored when it is finished; the same command continues with those that
are missing.
"""

import argparse
from pathlib import Path

import numpy as np

from gaitopt import (
    Collocation,
    GaitProblem,
    Limits,
    StabilityBound,
    assess_stability,
    compass_biped,
    solve,
    verify,
)
from tests.benchmarks import infeasible_designs_page, infeasible_problems
from tests.benchmarks.conftest import timed
from tests.benchmarks.infeasible_problems import change_all
from tests.benchmarks.random_problems import ROOT

COUNT, SEED = 60, 16
SEQUENCES = ("stick | stick", "slip+ stick | slip+")
KINDS = ("peak torque", "friction", "speed", "spectral radius", "step length")

RADIUS_TOLERANCE = 1e-6
"""Largest excess of the replayed spectral radius over its bound."""

RESULTS = ROOT / "docs" / "infeasible_designs.json"
PAGE = ROOT / "docs" / "infeasible_designs.md"


def draw_problem(number):
    """Return the kind of a demand that is likely to be excessive, and a problem with free masses of the compass biped.

    The centre of mass of the legs and the hip mass are free within narrow bounds.  The spectral radius is bounded in
    every third problem, and in those in which its bound is excessive.
    """
    rng = np.random.default_rng([SEED, number])
    kind = KINDS[number % len(KINDS)]
    com, hip = rng.uniform(0.6, 1.0), rng.uniform(1.2, 3.0)
    free = {
        "leg_com": (com * rng.uniform(0.8, 1.0), com * rng.uniform(1.0, 1.2)),
        "hip_mass": (hip * rng.uniform(0.7, 1.0), hip * rng.uniform(1.0, 1.3)),
    }
    friction, torque = rng.uniform(0.12, 0.2), rng.uniform(5, 12)
    speed, step = 0.633 * rng.uniform(0.85, 1.1), 0.4713 * rng.uniform(0.85, 1.1)
    radius = rng.uniform(0.05, 0.35) if kind == "spectral radius" else rng.uniform(0.7, 1.0)
    friction *= rng.uniform(0.1, 0.4) if kind == "friction" else 1.0
    torque *= rng.uniform(0.02, 0.15) if kind == "peak torque" else 1.0
    speed *= rng.uniform(2, 4) if kind == "speed" else 1.0
    step *= rng.uniform(1.6, 2.6) if kind == "step length" else 1.0
    sequence = SEQUENCES[0] if kind == "friction" else SEQUENCES[number // len(KINDS) % 2]
    is_bounded = kind == "spectral radius" or number % 3 == 0
    problem = GaitProblem(
        robot=compass_biped(),
        sequence=sequence,
        free=free,
        friction=friction,
        speed=speed,
        step_length=step,
        limits=Limits(torque=torque),
        objective="torque_squared",
        transcription=Collocation(intervals=20),
        stability=StabilityBound(radius=radius) if is_bounded else None,
    )
    return kind, problem


def measure(number):
    """Return the row of a problem: its status, and those of the problems with changed limits."""
    kind, problem = draw_problem(number)
    seconds, _, gait = timed(lambda: solve(problem))
    row = {
        "kind": kind,
        "sequence": str(problem.sequence),
        "radius": problem.stability and problem.stability.radius,
        "status": gait.status.key,
        "processor_seconds": round(seconds, 3),
    }
    if gait.status.ok:
        return row
    return row | {"message": gait.solver.message, "groups": check_conflicts(problem, gait.solver.conflicts)}


def check_conflicts(problem, conflicts):
    """Return the sets of limits that are named, and the statuses of the problems with these limits changed."""
    return [check_set(problem, group) for group in infeasible_problems.list_groups(conflicts)]


def check_set(problem, group):
    """Return the limits of a set, and the statuses with their sufficient values, without them, and without all but one.

    A set is a smallest one if it has one limit, or if no gait exists with one of its limits in force.
    """
    relaxed = solve_changed(problem, group, removed=False)
    removed = None if relaxed == "solved" else solve_changed(problem, group, removed=True)
    subsets = [[limit for limit in group if limit is not kept] for kept in group] if len(group) > 1 else []
    smaller = [solve_changed(problem, subset, removed=True) for subset in subsets]
    return {"limits": list(map(str, group)), "relaxed": relaxed, "removed": removed, "smaller": smaller}


def solve_changed(problem, group, *, removed):
    """Return the status of the verified gait with changed limits, ``"unstable"`` if it exceeds the spectral radius."""
    problem = change_all(problem, group, removed=removed)
    if problem is None:
        return "condition"
    gait = solve(problem)
    if not gait.status.ok:
        return gait.status.key
    gait = verify(gait)
    if (
        gait.status.ok
        and problem.stability
        and assess_stability(gait).radius > problem.stability.radius + RADIUS_TOLERANCE
    ):
        return "unstable"
    return gait.status.key


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT, help="number of infeasible problems")
    parser.add_argument("-o", "--output", type=Path, help="file of the results; no page is written")
    options = parser.parse_args()
    results = infeasible_problems.run(options.count, options.output or RESULTS, measure, SEED)
    if options.output is None:
        PAGE.write_text(infeasible_designs_page.compose_page(results), encoding="utf-8")
    print(infeasible_designs_page.summarise(results))


if __name__ == "__main__":
    main()
