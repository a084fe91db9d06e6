"""Kill studies at random instants: ``python -m tests.kills [COUNT] [STUDY...]`` (20 kills of each study by default).

A killed study leaves no process, and the same command continues it to the results of an undisturbed study, without
stray files.
"""

import os
import signal
import time

import numpy as np

from tests.studies import STUDIES, disturb, list_processes, print_faults, run_series, start, wait_for_orphans

SEED = 18


def draw_kills(count, seconds):
    """Return instants [s], and whether the workers are killed together with the command."""
    instants = np.random.default_rng(SEED).uniform(0.1, 1.0, count) * seconds
    return [(instant, number % 2 == 1) for number, instant in enumerate(instants)]


def kill_once(words, folder, kill):
    """Kill a command some seconds after its start, and its workers if requested; return the faults."""
    (after, whole), process = kill, start(words, folder)
    deadline = time.monotonic() + after
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    for number in list_processes(folder) if whole else [process.pid]:
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            continue
    process.communicate()
    return [f"processes {left} are left"] if (left := wait_for_orphans(folder)) else []


def kill_repeatedly(name, count):
    """Kill a study repeatedly, and return what went wrong."""
    seconds, faults = disturb(name, lambda seconds: draw_kills(count, seconds), kill_once)
    print_faults(f"{name}: {count} kills, {len(faults)} faults; {seconds:.0f} s without a kill", faults)
    return faults


if __name__ == "__main__":
    run_series(kill_repeatedly, STUDIES, 20)
