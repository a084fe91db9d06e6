"""A basin of the passive compass by two processes: ``python -m tests.benchmarks.basin_run gaitopt`` or ``bare``.

10,000 starts about Gait B ("slip+ stick slip- | stick" at friction 0.14) of at most 20 steps each, nine tenths of which
are walked.  The bare way is a plain process pool, each process with its own compiled integrators and the step
written by hand.  Prints, as JSON: seconds with the start of the pool, seconds from the first answer on, processor
seconds of both processes, steps taken, peak memory of the larger process [MB], and steps and last angle of each start.
"""

import itertools
import json
import math
import resource
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from tests.benchmarks import bare_heyoka

FRICTION, STEPS, WORKERS, CHUNK = 0.14, 20, 2, 200
ANGLE, STANCE, SWING = -0.140807105, np.linspace(0.698, 0.714, 100), np.linspace(-0.55, -0.49, 100)
BARE = []


def prepare():
    BARE.append(bare_heyoka.BareCompass(FRICTION))


def walk(starts):
    return [BARE[0].walk(start, STEPS) for start in starts]


def bare(progress):
    """Return steps tried, and the last state (th1, foot speed) of each start, by a plain pool."""
    starts = [(0.0, ANGLE, ANGLE, 0.0, *rates) for rates in itertools.product(STANCE.tolist(), SWING.tolist())]
    chunks = [starts[i : i + CHUNK] for i in range(0, len(starts), CHUNK)]
    answers = []
    with ProcessPoolExecutor(WORKERS, get_context("spawn"), initializer=prepare) as pool:
        for answer in pool.map(walk, chunks):
            answers += answer
            progress()
    return [steps for steps, _, _ in answers], [state[1] for _, state, _ in answers]


def gaitopt(progress):
    """Return the same by gaitopt."""
    from gaitopt import Execution, SettlingCriterion, basin, compass_biped

    found = basin(
        compass_biped(),
        {"slope": bare_heyoka.SLOPE, "friction": FRICTION, "th1": ANGLE},
        {"th1_rate": STANCE, "th2_rate": SWING},
        criterion=SettlingCriterion(steps=STEPS),
        execution=Execution(workers=WORKERS, observer=lambda done, total: progress()),
    )
    return found.steps.values.ravel().tolist(), found.final.sel(coordinate="th1").values.ravel().tolist()


def main(which):
    times = []
    began = time.perf_counter()
    steps, angles = {"bare": bare, "gaitopt": gaitopt}[which](lambda: times.append(time.perf_counter()))
    seconds = time.perf_counter() - began
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    answers = {
        "seconds": seconds,
        "walking": times[-1] - times[0],
        "processor": used.ru_utime + used.ru_stime,
        "steps": sum(steps),
        "megabytes": used.ru_maxrss / 1024,
        "each": steps,
        "angles": angles,
    }
    assert math.prod((STANCE.size, SWING.size)) == len(steps)
    print(json.dumps(answers))


if __name__ == "__main__":
    main(sys.argv[1])
