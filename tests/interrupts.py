"""Interrupt commands at random instants: ``python -m tests.interrupts [COUNT] [COMMAND...]`` (60 interrupts of each).

A command ends with status 130 within two seconds of Ctrl-C, without a traceback, a stray file or a process.  A study is
then continued to the results of an undisturbed one.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.studies import COMMANDS, STUDIES, finish, is_same, read_results, start, stray_files, wait_for_orphans

SEED, WITHIN, SLOW = 18, 2.0, 60.0
"""Seed, the time in which a command ends on an idle machine, and the time after which it counts as hanging [s]."""


def interrupt_once(words, folder, after):
    """Interrupt a command and its workers some seconds after its start; return the faults and the time it took."""
    process = start(words, folder)
    try:
        process.wait(after)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
    began = time.monotonic()
    try:
        _, errors = process.communicate(timeout=SLOW)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return [f"hangs after an interrupt at {after:.2f} s"], SLOW
    seconds, faults = time.monotonic() - began, []
    if process.returncode not in (0, 1, 128 + signal.SIGINT):
        faults.append(f"status {process.returncode} after an interrupt at {after:.2f} s: {errors[-200:]}")
    if "Traceback" in errors:
        faults.append(f"traceback after an interrupt at {after:.2f} s: {errors[-300:]}")
    if left := wait_for_orphans(folder):
        faults.append(f"processes {left} are left")
    kept = (".parts", ".checkpoint")  # with which the command continues
    if strays := [name for name in stray_files(folder) if not name.endswith(kept)]:
        faults.append(f"stray files {strays}")
    return faults, seconds


def disturb(name, count, report=print):
    """Interrupt a command repeatedly, and return what went wrong."""
    words, rng, faults, times = COMMANDS[name], np.random.default_rng(SEED), [], []
    with tempfile.TemporaryDirectory() as top:
        undisturbed = Path(top) / "undisturbed"
        undisturbed.mkdir()
        began = time.monotonic()
        faults += finish(words, undisturbed)
        seconds = time.monotonic() - began
        for number in range(count):
            folder = Path(top) / f"interrupt-{number}"
            folder.mkdir()
            found, took = interrupt_once(words, folder, rng.uniform(0.0, 1.0) * seconds)
            times.append(took)
            if name in STUDIES and number % 10 == 0:
                found += finish(words, folder)
                if not is_same(read_results(folder), read_results(undisturbed)):
                    found.append("the results differ from those of an undisturbed study")
            faults += [f"interrupt {number}: {fault}" for fault in found]
    late = sum(took > WITHIN for took in times)
    report(f"{name}: {count} interrupts, {len(faults)} faults; {late} ended after {WITHIN:g} s, the last after "
           f"{max(times):.1f} s", flush=True)  # fmt: skip
    for fault in faults:
        report(f"  {fault}", flush=True)
    return faults


if __name__ == "__main__":
    words = sys.argv[1:]
    count = int(words.pop(0)) if words and words[0].isdecimal() else 60
    faults = [fault for name in words or COMMANDS for fault in disturb(name, count)]
    sys.exit(1 if faults else 0)
