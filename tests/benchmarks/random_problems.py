"""One hundred seeded random problems: the default solve beside the best gaits known.

``python -m tests.benchmarks.random_problems`` solves every problem with the default options, replays the gaits and
writes ``docs/random_problems.json`` and the page ``docs/random_problems.md``; ``--best-known`` computes the reference
costs in ``tests/references/random_problems.json`` instead, which takes seven minutes of processor time.  Every problem
is stored when it is finished; the same command continues with those that are missing.
"""

import argparse
import datetime
import json
import time
from pathlib import Path
from unittest import mock

import numpy as np

import gaitopt
from gaitopt import Collocation, GaitProblem, Limits, Newton, WarmStart, compass_biped, solve, verify
from gaitopt.simulation.verification import replay
from gaitopt.study.multistart import COARSE_SOLVER, FINE_SOLVER, default_starts, solve_start
from tests.benchmarks import random_problems_page

COUNT, SEED = 100, 13
SEQUENCES = ("stick | stick", "slip+ stick | slip+")
OBJECTIVES = ("cost_of_transport", "torque_squared", "positive_work")

ROOT = Path(__file__).parents[2]
BEST_KNOWN = ROOT / "tests" / "references" / "random_problems.json"
RESULTS = ROOT / "docs" / "random_problems.json"

STARTS, COARSE_GRIDS, FINE_GRID, FINEST_GRID = 12, (10, 20), 80, 160
"""Starts of the best known gaits on each coarse grid, and the intervals of the grids."""

COST_RANGE, SAME_COST = 0.15, 5e-4
"""Coarse solutions are refined if they exceed the lowest cost by at most the first; below the second, relative
difference, two are the same."""

REFINED, FINEST = 8, 3
"""Largest number of different solutions on the grids of 80 and of 160 intervals."""


def draw_problem(number):
    """Return a problem near the reference one: frictions 0.1 to 0.25, speeds and steps, masses, lengths and limits.

    Two sequences alternate, and three objectives after every two problems; half of the robots are varied.
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
        sequence=SEQUENCES[number % 2],
        objective=OBJECTIVES[number // 2 % 3],
        parameters=parameters if number // 6 % 2 else {},
        friction=rng.uniform(0.1, 0.25),
        speed=0.633 * rng.uniform(0.75, 1.25),
        step_length=0.4713 * rng.uniform(0.8, 1.2),
        limits=Limits(torque=rng.uniform(8, 20)),
    )


def measure_default(number, starts=None):
    """Return the results of the default solve of a problem, or of one with a number of starts."""
    problem, results = draw_problem(number), []
    minimise = Newton.minimise

    def record(*arguments, **options):
        results.append(minimise(*arguments, **options))
        return results[-1]

    seconds, began = time.perf_counter(), time.process_time()
    with mock.patch.object(Newton, "minimise", record):
        gait = solve(problem) if starts is None else solve(problem, starts=starts)
    seconds, processor = time.perf_counter() - seconds, time.process_time() - began
    row = {
        "sequence": str(problem.sequence),
        "objective": problem.objective.name,
        "status": gait.status.key,
        "cost": None,
        "iterations": gait.solver.iterations,
        "seconds": round(seconds, 3),
        "processor_seconds": round(processor, 3),
        "build_seconds": round(gait.solver.build_seconds, 3),
        "intervals": gait.problem["intervals"],
        "guess": gait.problem["guess"],
    }
    if gait.status.ok:
        verified, evaluate = verify(gait), problem.objective.evaluate
        row |= {
            "cost": gait.solver.objective,
            "estimate": getattr(gait.solver, "cost_error", None),
            "plan": float(evaluate(gait.motion)),
            "minimised": find_minimised(gait, results),
            "replayed": float(evaluate(replay(gait).motion)),
            "verified": verified.status.key,
            "limit": find_limit(problem, gait),
        }
    return row


def find_limit(problem, gait):
    """Return the cost of the local optimum of a gait on 80 and then 160 intervals, the finest that is solved."""
    limit = None
    for intervals in (FINE_GRID, FINEST_GRID):
        finer = solve_start(with_grid(problem, intervals), WarmStart(gait), FINE_SOLVER)
        if finer.status.ok and verify(finer).status.ok:
            gait, limit = finer, float(finer.solver.objective)
    return limit


def find_minimised(gait, results):
    """Return the minimised value of the solve whose unknowns a gait contains."""
    unknowns = np.sort(np.concatenate([table.values.ravel() for table in gait.solution.unknowns.values()]))
    same_size = [result for result in results if result.x.size == unknowns.size]
    if not same_size:
        return None
    nearest = min(same_size, key=lambda result: np.max(np.abs(np.sort(result.x) - unknowns)))
    return float(nearest.objective)


def find_best_known(number):
    """Return the lowest cost of a problem over several starts and grids, among gaits that pass their replay."""
    problem, began = draw_problem(number), time.process_time()
    guesses, coarse = default_starts(problem, STARTS), []
    for intervals in COARSE_GRIDS:
        on_grid = with_grid(problem, intervals, tolerance=np.inf)
        for guess in guesses:
            gait = solve_start(on_grid, guess, COARSE_SOLVER)
            if gait.status.ok:
                coarse.append((gait.solver.objective, gait, f"{guess.describe()}, {intervals} intervals"))
    fine = refine(problem, coarse, FINE_GRID, REFINED)
    finest = refine(problem, fine, FINEST_GRID, FINEST)
    row = {
        "sequence": str(problem.sequence),
        "objective": problem.objective.name,
        "fine": [cost for cost, *_ in fine],
        "finest": [cost for cost, *_ in finest],
        "best": None,
        "processor_seconds": round(time.process_time() - began, 1),
    }
    if fine or finest:
        cost, gait, start = min([*fine, *finest], key=lambda entry: entry[0])
        row |= {"best": cost, "intervals": gait.problem["intervals"], "start": start}
    return row


def refine(problem, gaits, intervals, most):
    """Return the verified gaits on a grid, warm-started from the best different ones, in the order of their cost."""
    chosen, refined = [], []
    for cost, gait, start in sorted(gaits, key=lambda entry: entry[0]):
        near = not chosen or cost <= chosen[0][0] * (1 + COST_RANGE)
        if near and len(chosen) < most and all(abs(cost / other - 1) > SAME_COST for other, *_ in chosen):
            chosen.append((cost, gait, start))
    for _, gait, start in chosen:
        fine = solve_start(with_grid(problem, intervals), WarmStart(gait), FINE_SOLVER)
        if fine.status.ok and verify(fine).status.ok:
            refined.append((fine.solver.objective, fine, start))
    return sorted(refined, key=lambda entry: entry[0])


def with_grid(problem, intervals, **options):
    """Return a problem on a grid of some intervals."""
    return problem.replace(transcription=Collocation(intervals=intervals, **options))


def run(compute, count, path):
    """Compute the rows that a file lacks, in the order of their numbers, and store each when it is finished."""
    stored = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"problems": {}}
    for number in range(count):
        if str(number) in stored["problems"]:
            continue
        row = compute(number)
        stored["problems"][str(number)] = row
        stored |= {"date": datetime.date.today().isoformat(), "seed": SEED, "versions": versions()}
        write_whole(path, json.dumps(stored, indent=1) + "\n")
        print(number, json.dumps(row), flush=True)
    return stored


def versions():
    """Return the versions of gaitopt and CasADi."""
    import casadi

    return {"gaitopt": gaitopt.__version__, "casadi": casadi.__version__}


def write_whole(path, text):
    """Replace a file in one step, so that an interrupt leaves the previous one."""
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT, help="number of problems, from the first one")
    parser.add_argument("--best-known", action="store_true", help="compute the reference costs")
    parser.add_argument("--starts", type=int, help="number of starts, instead of the default")
    parser.add_argument("-o", "--output", type=Path, help="file of the results; no page is written")
    options = parser.parse_args()
    if options.best_known:
        run(find_best_known, options.count, options.output or BEST_KNOWN)
        return
    results = run(lambda number: measure_default(number, options.starts), options.count, options.output or RESULTS)
    best = json.loads(BEST_KNOWN.read_text(encoding="utf-8")) if BEST_KNOWN.exists() else {"problems": {}}
    page = random_problems_page.compose_page(results, best)
    if options.output is None:
        (ROOT / "docs" / "random_problems.md").write_text(page, encoding="utf-8")
    print(random_problems_page.summarise(results, best))


if __name__ == "__main__":
    main()
