"""Kill studies at random instants: ``python -m tests.kills [COUNT] [STUDY...]`` (20 kills of each study by default).

A killed study leaves no process, and the same command continues it to the results of an undisturbed study, without
stray files.
"""

import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.studies import STUDIES, finish, is_same, list_processes, read_results, start, wait_for_orphans

SEED = 18


def kill_once(words, folder, after, whole):
    """Kill a command some seconds after its start, with `whole` together with its workers."""
    process = start(words, folder)
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


def disturb(name, count, report=print):
    """Kill a study repeatedly, and return what went wrong."""
    words, rng, faults = STUDIES[name], np.random.default_rng(SEED), []
    with tempfile.TemporaryDirectory() as top:
        undisturbed = Path(top) / "undisturbed"
        undisturbed.mkdir()
        began = time.monotonic()
        faults += finish(words, undisturbed)
        seconds, expected = time.monotonic() - began, read_results(undisturbed)
        for number in range(count):
            folder = Path(top) / f"kill-{number}"
            folder.mkdir()
            found = kill_once(words, folder, rng.uniform(0.1, 1.0) * seconds, whole=number % 2 == 1)
            found += finish(words, folder)
            if not is_same(read_results(folder), expected):
                found.append("the results differ from those of an undisturbed study")
            faults += [f"kill {number}: {fault}" for fault in found]
    report(f"{name}: {count} kills, {len(faults)} faults; {seconds:.0f} s without a kill", flush=True)
    for fault in faults:
        report(f"  {fault}", flush=True)
    return faults


if __name__ == "__main__":
    words = sys.argv[1:]
    count = int(words.pop(0)) if words and words[0].isdecimal() else 20
    faults = [fault for name in words or STUDIES for fault in disturb(name, count)]
    sys.exit(1 if faults else 0)
