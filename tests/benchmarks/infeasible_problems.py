"""One hundred infeasible random problems: the time to report them, and whether the limits that are named conflict.

``python -m tests.benchmarks.infeasible_problems`` solves every problem with the default options, changes the limits
that are named, solves and verifies again, and writes ``docs/infeasible_problems.json`` and the page
``docs/infeasible_problems.md``.  A feasible problem is solved after every infeasible one, for comparison of the time.
Every problem is stored when it is finished; the same command continues with those that are missing.
"""

import argparse
import datetime
import json
import math
from pathlib import Path

import numpy as np

from gaitopt import GaitProblem, Limits, Margins, StabilityBound, compass_biped, solve, verify
from tests.benchmarks import infeasible_problems_page
from tests.benchmarks.conftest import timed
from tests.benchmarks.random_problems import ROOT, versions, write_whole

COUNT, MOST_DRAWS, SEED = 100, 200, 5
SEQUENCES = ("stick | stick", "slip+ stick | slip+", "slip+ stick | stick")
OBJECTIVES = ("cost_of_transport", "torque_squared")
KINDS = ("torque", "step", "speed")

WIDEST = {"leg_com": (0.05, 1.55), "hip_mass": (0.05, 50.0)}
"""Bounds of free parameters of the compass biped that are removed [m, kg]."""

RESULTS = ROOT / "docs" / "infeasible_problems.json"
PAGE = ROOT / "docs" / "infeasible_problems.md"


def draw_problem(number, kind):
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


def draw_demanding(number):
    """Return the kind of a problem that is likely to be infeasible, and the problem."""
    kind = KINDS[number // 2 % len(KINDS)]
    return kind, draw_problem(number, kind)


def measure(number):
    """Return the row of a problem: time and status, and the statuses of the problems with changed limits."""
    kind, problem = draw_demanding(number)
    seconds, _, gait = timed(lambda: solve(problem))
    compared, _, feasible = timed(lambda: solve(draw_problem(number, "solvable")))
    row = {
        "kind": kind,
        "sequence": str(problem.sequence),
        "objective": problem.objective.name,
        "status": gait.status.key,
        "processor_seconds": round(seconds, 3),
        "build_seconds": round(gait.solver.build_seconds, 3),
        "feasible_status": feasible.status.key,
        "feasible_seconds": round(compared, 3),
    }
    if gait.status.ok:
        return row
    return row | {"message": gait.solver.message, "groups": check_conflicts(problem, gait.solver.conflicts)}


def check_conflicts(problem, conflicts):
    """Return the groups of limits that are named, and the statuses of the problems with changed limits."""
    return [check_group(problem, group) for group in list_groups(conflicts)]


def list_groups(conflicts):
    """Return the limits that are named, in groups that suffice: each that is enough alone, otherwise all of them."""
    alone = bool(conflicts) and conflicts[0].separable
    return [[conflict] for conflict in conflicts] if alone else [conflicts] if conflicts else []


def check_group(problem, group):
    """Return the limits of a group, and the statuses with their sufficient values and, if not solved, without."""
    relaxed = solve_changed(problem, group, removed=False)
    removed = None if relaxed == "solved" else solve_changed(problem, group, removed=True)
    return {"limits": list(map(str, group)), "relaxed": relaxed, "removed": removed}


def solve_changed(problem, group, *, removed):
    """Return the status of the verified gait with changed limits; ``"condition"`` if one is not an argument."""
    problem = change_all(problem, group, removed=removed)
    if problem is None:
        return "condition"
    gait = solve(problem)
    return (verify(gait) if gait.status.ok else gait).status.key


def change_all(problem, group, *, removed):
    """Return a problem with several limits changed; None if one of them is a condition."""
    for conflict in group:
        problem = problem and change(problem, conflict, removed=removed)
    return problem


def change(problem, conflict, *, removed):
    """Return a problem without a limit, or with the value that is reported as sufficient; None for a condition."""
    value = conflict.sufficient
    if conflict.setting in ("speed", "step_length"):
        return problem.replace(**{conflict.setting: None if removed else value})
    if conflict.setting == "Limits.torque":
        actuator = conflict.name.removeprefix("torque limit of ")
        torques = dict(zip(problem.robot.actuators, problem.limits.torques(problem.robot.actuators), strict=True))
        return problem.replace(limits=Limits(torque={**torques, actuator: math.inf if removed else value}))
    if conflict.setting == "StabilityBound.radius":
        return problem.replace(stability=None if removed else StabilityBound(radius=value))
    if conflict.setting == "free":
        ends = np.array(problem.free[conflict.name])
        exceeded = int(conflict.limit == ends[1])
        ends[exceeded] = WIDEST[conflict.name][exceeded] if removed else value
        return problem.replace(free={**problem.free, conflict.name: tuple(ends.tolist())})
    if conflict.setting == "friction" and not math.isnan(value):
        return problem.replace(friction=math.inf if removed else value)
    if conflict.setting.startswith("Margins.") and not math.isnan(value):
        return problem.replace(
            margins=Margins(**{conflict.setting.removeprefix("Margins."): 0.0 if removed else value})
        )
    return None


def run(count, path, measure=measure, seed=SEED):
    """Compute the rows that a file lacks until it has a number of infeasible problems, and store each one."""
    stored = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"problems": {}}
    solve(draw_problem(0, "solvable"))  # the first call imports
    for number in range(MOST_DRAWS):
        if len(infeasible_problems_page.list_infeasible(stored)) >= count:
            break
        if str(number) in stored["problems"]:
            continue
        stored["problems"][str(number)] = measure(number)
        stored |= {"date": datetime.date.today().isoformat(), "seed": seed, "versions": versions()}
        write_whole(path, json.dumps(stored, indent=1) + "\n")
        print(number, json.dumps(stored["problems"][str(number)]), flush=True)
    return stored


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT, help="number of infeasible problems")
    parser.add_argument("-o", "--output", type=Path, help="file of the results; no page is written")
    options = parser.parse_args()
    results = run(options.count, options.output or RESULTS)
    if options.output is None:
        PAGE.write_text(infeasible_problems_page.compose_page(results), encoding="utf-8")
    print(infeasible_problems_page.summarise(results))


if __name__ == "__main__":
    main()
