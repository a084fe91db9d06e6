"""Run studies on a full disk or with little memory: ``python -m tests.full_disk [COUNT] [STUDY...]``.

No file grows beyond a limit (RLIMIT_FSIZE), or no process beyond an address space (RLIMIT_AS), at COUNT values of each
(20 by default).  A study then ends with a sentence, and without the limit the same command continues it to the results
of an undisturbed study.
"""

import functools
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.studies import STUDIES, finish, is_same, read_results, start, wait_for_orphans

LIMITS = {"disk": (resource.RLIMIT_FSIZE, 1e2, 1e6), "memory": (resource.RLIMIT_AS, 5e8, 4e9)}
"""Resource, and the least and the largest limit [bytes]."""

SLOW = 180.0
"""Time after which a command counts as hanging [s]."""


def run_limited(words, folder, kind, limit):
    """Return the faults of a command with a limit, and whether the limit stopped it."""
    limits = functools.partial(resource.setrlimit, LIMITS[kind][0], (limit, limit))
    process = start(words, folder, preexec_fn=limits)
    try:
        _, errors = process.communicate(timeout=SLOW)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        wait_for_orphans(folder)
        return [f"hangs with a limit of {limit} bytes"], True
    faults = [f"processes {left} are left" for left in [wait_for_orphans(folder)] if left]
    if "Traceback" in errors or process.returncode not in (0, 1, 2, 130):
        faults.append(f"limit of {limit} bytes: status {process.returncode}, {errors.strip()[-300:]}")
    return faults, process.returncode != 0


def disturb(name, kind, count, report=print):
    """Run a study with limits, and return what went wrong."""
    words, faults, stopped = STUDIES[name], [], 0
    with tempfile.TemporaryDirectory() as top:
        undisturbed = Path(top) / "undisturbed"
        undisturbed.mkdir()
        faults += finish(words, undisturbed)
        for number, limit in enumerate(np.geomspace(*LIMITS[kind][1:], count)):
            folder = Path(top) / f"{kind}-{number}"
            folder.mkdir()
            found, ended = run_limited(words, folder, kind, int(limit))
            stopped += ended
            found += finish(words, folder)
            if not is_same(read_results(folder), read_results(undisturbed)):
                found.append("the results differ from those of an undisturbed study")
            faults += [f"{kind} {number}: {fault}" for fault in found]
    report(f"{name}, {kind}: {count} limits, of which {stopped} stopped it; {len(faults)} faults", flush=True)
    for fault in faults:
        report(f"  {fault}", flush=True)
    return faults


if __name__ == "__main__":
    words = sys.argv[1:]
    count = int(words.pop(0)) if words and words[0].isdecimal() else 20
    faults = [fault for name in words or STUDIES for kind in LIMITS for fault in disturb(name, kind, count)]
    sys.exit(1 if faults else 0)
