"""Compute the frozen results and write them to the JSON files beside this script; never run by pytest.

    OMP_NUM_THREADS=1 python -m tests.frozen.make_frozen [problems] [published] [studies] [--workers N]

Run it only to add results, with code whose results are known to be right: running it after a change of the code makes
the comparison worthless.  A random problem is taken only if its results survive changes of gravity by 1e-12, within a
fifth of the tolerances: it is then no matter in which order the code adds its numbers.
"""

import argparse
import concurrent.futures
import multiprocessing

import numpy as np

from tests.frozen import candidates, computations, studies
from tests.frozen.comparison import assert_agree
from tests.frozen.storage import FILES, save_frozen

SHARE, SHAKES, ATTEMPTS = 0.2, (1e-12, -1e-12), 8
DEFAULT_SEED = 35
"""Seed of the problems that the default run solves; with this one it takes less than a minute."""

GRAVITY = {"compass_biped": 9.8, "five_link": 9.81}


def shake(statement, change):
    """Return a statement with gravity changed by a relative amount."""
    parameters = {"gravity": GRAVITY[statement["robot"]]} | statement.get("parameters", {})
    return statement | {"parameters": parameters | {"gravity": parameters["gravity"] * (1 + change)}}


def is_expected(result, solved):
    """Return whether a problem that should have a gait has one that passes its verification, and the others none."""
    if not solved:
        return result["status"] == "infeasible"
    return result["status"] == "solved" and result["verification"]["passed"]


def fill_slot(slot):
    """Return the entry of the first attempt at a slot whose results are expected and well-conditioned, or None."""
    name, solved, _ = candidates.slots()[slot]
    for attempt in range(ATTEMPTS):
        statement = candidates.draw(slot, attempt)
        result = computations.solve_problem(statement)
        if not is_expected(result, solved):
            continue
        try:
            for change in SHAKES:
                assert_agree(computations.solve_problem(shake(statement, change)), result, share=SHARE)
        except AssertionError as error:
            print(f"slot {slot} ({name}), attempt {attempt}: {error}", flush=True)
            continue
        return {
            "name": f"{slot:02d} {name}",
            "default": False,
            "computation": "solve_problem",
            "arguments": {"statement": statement},
            "result": result,
        }
    print(f"slot {slot} ({name}): no attempt is taken", flush=True)
    return None


def choose_default(entries):
    """Return the entries with one of every three, drawn at random, marked for the default run."""
    rng, chosen = np.random.default_rng(DEFAULT_SEED), set()
    for first in range(0, len(entries), 3):
        chosen.add(first + int(rng.integers(min(3, len(entries) - first))))
    return [entry | {"default": number in chosen} for number, entry in enumerate(entries)]


def make_problems(workers):
    """Return the random problems and their results."""
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(workers, context) as pool:
        entries = list(pool.map(fill_slot, range(len(candidates.slots()))))
    return choose_default([entry for entry in entries if entry is not None])


def make_others(planned):
    """Return the results of computations that are not random."""
    return [
        {
            "name": name,
            "default": name not in studies.LONG,
            "computation": computation,
            "arguments": arguments,
            "result": getattr(computations, computation)(**arguments),
        }
        for name, computation, arguments in planned
    ]


def main():
    """Compute what is named on the command line, everything if nothing is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help=f"of {', '.join(FILES)}; all by default")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    for name in options.files or FILES:
        made = make_problems(options.workers) if name == "problems" else make_others(getattr(studies, name)())
        save_frozen(name, made)
        print(f"{name}.json: {len(made)} entries", flush=True)


if __name__ == "__main__":
    main()
