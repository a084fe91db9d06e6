"""Kill studies at random instants: ``python -m tests.kills [COUNT] [STUDY...]`` (20 kills of each study by default).

A killed study leaves no process, and the same command, killed again, continues it to the results of an undisturbed
study, without stray files.
"""

import itertools
import os
import signal
import time

import numpy as np

from tests.studies import STUDIES, disturb, list_processes, print_faults, run_series, start, wait_for_orphans

SEED = 18


def draw_kills(count, seconds):
    """Yield instants [s], and whether the workers are killed together with the command."""
    rng = np.random.default_rng([SEED, count])
    for number in itertools.count():
        yield rng.uniform(0.1, 1.0) * seconds, number % 2 == 1


def kill_once(words, folder, kill):
    """Kill a command some seconds after its start, and its workers if requested.

    Return whether it was running, and the faults.
    """
    (after, whole), process = kill, start(words, folder)
    deadline = time.monotonic() + after
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    running = process.poll() is None
    for number in list_processes(folder) if whole else [process.pid]:
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            continue
    process.communicate()
    return running, [f"processes {left} are left"] if (left := wait_for_orphans(folder)) else []


def kill_repeatedly(name, count):
    """Kill a study repeatedly, and return what went wrong."""
    done, faults = disturb(name, count, lambda seconds: draw_kills(count, seconds), kill_once)
    print_faults(f"{name}: {done} kills, {len(faults)} faults", faults)
    return faults


if __name__ == "__main__":
    run_series(kill_repeatedly, STUDIES, 20)
