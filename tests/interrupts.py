"""Interrupt commands at random instants: ``python -m tests.interrupts [COUNT] [COMMAND...]`` (60 interrupts of each).

A command ends with status 130 within two seconds of Ctrl-C, without a traceback, a stray file or a process.  A study is
then continued to the results of an undisturbed one.
"""

import os
import signal
import subprocess
import time

import numpy as np

from tests.studies import COMMANDS, disturb, print_faults, run_series, start, stray_files, wait_for_orphans

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


def interrupt_repeatedly(name, count):
    """Interrupt a command repeatedly, and return what went wrong."""
    times = []

    def apply(words, folder, after):
        faults, seconds = interrupt_once(words, folder, after)
        times.append(seconds)
        return faults

    def draw(seconds):
        return np.random.default_rng(SEED).uniform(0.0, 1.0, count) * seconds

    _, faults = disturb(name, draw, apply, every=10)
    late, last = sum(seconds > WITHIN for seconds in times), max(times, default=0.0)
    ends = f"{late} ended after {WITHIN:g} s, the last after {last:.1f} s"
    print_faults(f"{name}: {count} interrupts, {len(faults)} faults; {ends}", faults)
    return faults


if __name__ == "__main__":
    run_series(interrupt_repeatedly, COMMANDS, 60)
