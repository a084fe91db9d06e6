"""Run studies on a full disk or with little memory: ``python -m tests.full_disk [COUNT] [STUDY...]``.

No file grows beyond a limit (RLIMIT_FSIZE), or no process beyond an address space (RLIMIT_AS), at COUNT values of each
(20 by default).  A study then ends with a sentence, and without the limit the same command continues it to the results
of an undisturbed study.
"""

import functools
import resource
import subprocess

import numpy as np

from tests.studies import STUDIES, disturb, print_faults, run_series, start, wait_for_orphans

LIMITS = {"disk": (resource.RLIMIT_FSIZE, 1e2, 1e6), "memory": (resource.RLIMIT_AS, 5e8, 4e9)}
"""Resource, and the least and the largest limit [bytes]."""

SLOW = 180.0
"""Time after which a command counts as hanging [s]."""


def run_limited(words, folder, kind, limit):
    """Return whether a limit stopped a command, and the faults."""
    limits = functools.partial(resource.setrlimit, LIMITS[kind][0], (limit, limit))
    process = start(words, folder, preexec_fn=limits)
    try:
        _, errors = process.communicate(timeout=SLOW)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        wait_for_orphans(folder)
        return True, [f"hangs with a limit of {limit} bytes"]
    faults = [f"processes {left} are left" for left in [wait_for_orphans(folder)] if left]
    if "Traceback" in errors or process.returncode not in (0, 1, 2, 130):
        faults.append(f"limit of {limit} bytes: status {process.returncode}, {errors.strip()[-300:]}")
    return process.returncode != 0, faults


def limit_repeatedly(name, kind, count):
    """Run a study with limits of one kind, and return what went wrong."""

    def apply(words, folder, limit):
        return run_limited(words, folder, kind, int(limit))

    stopped, faults = disturb(name, count, lambda seconds: iter(np.geomspace(*LIMITS[kind][1:], count)), apply)
    summary = f"{name}, {kind}: {count} limits, of which {stopped} stopped it; {len(faults)} faults"
    print_faults(summary, faults)
    return faults


if __name__ == "__main__":
    run_series(
        lambda name, count: [fault for kind in LIMITS for fault in limit_repeatedly(name, kind, count)], STUDIES, 20
    )
