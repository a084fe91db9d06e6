"""Interrupt commands at random instants: ``python -m tests.interrupts [COUNT] [COMMAND...]`` (60 interrupts of each).

A command ends with status 130 within two seconds of Ctrl-C, without a traceback, a stray file or a process.  A study is
then continued to the results of an undisturbed one.  The time for which the main thread is ready to run but has no
processor is subtracted, so that other processes do not count (Linux; their delay of the workers does count).
"""

import itertools
import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np

from tests.studies import COMMANDS, disturb, print_faults, run_series, start, stray_files, wait_for_orphans

SEED, WITHIN, SLOW = 18, 2.0, 60.0
"""Seed, the time in which a command ends that has a processor, and the time after which it counts as hanging [s]."""


def interrupt_once(words, folder, after):
    """Interrupt a command and its workers some seconds after its start.

    Return the time until its end [s], without and with the wait for a processor (None if it ended before the
    interrupt), and the faults.
    """
    process = start(words, folder)
    try:
        process.wait(after)
        process.communicate()
        return None, []
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
    began, before = time.monotonic(), read_delay(process.pid)
    delay = before
    while process.poll() is None and time.monotonic() < began + SLOW:
        delay = read_delay(process.pid) or delay
        time.sleep(0.02)
    wall = time.monotonic() - began
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return (SLOW, SLOW), [f"hangs after an interrupt at {after:.2f} s"]
    _, errors = process.communicate()
    seconds = wall - (delay - before)
    starting = process.returncode == -signal.SIGINT and "gaitopt/cli" not in errors
    if starting or "init_import_site" in errors:
        return (seconds, wall), []  # while the interpreter starts and imports the package, before any code of a command
    faults = []
    if process.returncode not in (0, 1, 128 + signal.SIGINT):
        faults.append(f"status {process.returncode} after an interrupt at {after:.2f} s: {errors[-200:]}")
    if "Traceback" in errors:
        faults.append(f"traceback after an interrupt at {after:.2f} s: {errors[-300:]}")
    if "leaked" in errors:
        faults.append(f"semaphores are left after an interrupt at {after:.2f} s: {errors[-300:]}")
    if left := wait_for_orphans(folder):
        faults.append(f"processes {left} are left")
    kept = (".parts", ".checkpoint")  # with which the command continues
    if strays := [name for name in stray_files(folder) if not name.endswith(kept)]:
        faults.append(f"stray files {strays}")
    if seconds > WITHIN:
        end = f"ended with status {process.returncode}"
        faults.append(f"{end} {seconds:.1f} s after an interrupt at {after:.2f} s")
    return (seconds, wall), faults


def read_delay(number):
    """Return the time for which the main thread of a process was ready to run without a processor [s]; 0 if unknown."""
    try:
        return int(Path(f"/proc/{number}/schedstat").read_text().split()[1]) / 1e9
    except (OSError, IndexError):
        return 0.0


def interrupt_repeatedly(name, count):
    """Interrupt a command repeatedly, and return what went wrong."""
    times = []

    def apply(words, folder, after):
        seconds, faults = interrupt_once(words, folder, after)
        if seconds is not None:
            times.append(seconds)
            print(f"{name}: at {after:.2f} s, ended after {seconds[0]:.2f} s, wall {seconds[1]:.2f} s", flush=True)
        return seconds is not None, faults

    def draw(seconds):
        rng = np.random.default_rng([SEED, count])
        return (rng.uniform() * seconds for _ in itertools.count())

    done, faults = disturb(name, count, draw, apply)
    last, wall = (max((pair[index] for pair in times), default=0.0) for index in (0, 1))
    print_faults(
        f"{name}: {done} interrupts, {len(faults)} faults; the last ended after {last:.1f} s, wall {wall:.1f} s", faults
    )
    return faults


if __name__ == "__main__":
    # A background job of a shell ignores SIGINT, which its commands would inherit: no interrupt would reach them.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    run_series(interrupt_repeatedly, COMMANDS, 60)
