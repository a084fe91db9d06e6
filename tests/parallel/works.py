"""Work for the runner's tests: workers import it, so it is a separate module."""

import os
import signal
import sys
import time
from pathlib import Path


def add(shared, argument, *needed):
    return shared + argument + sum(needed)


def slow_add(shared, argument, *needed):
    time.sleep(0.01 * (argument % 3))
    return add(shared, argument, *needed)


def die(folder, argument, *needed):
    """Kill this worker, always ("guilty") or the first time ("unlucky")."""
    seen = Path(folder) / f"seen-{argument}"
    if argument == "guilty" or (argument == "unlucky" and not seen.exists()):
        seen.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return argument


def fail(shared, argument):
    raise ValueError(f"{shared} {argument}")


def environment(shared, argument):
    time.sleep(0.05)
    blocked = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())
    return os.getpid(), os.environ.get("OMP_NUM_THREADS"), blocked


def rest(shared, seconds):
    time.sleep(seconds)


def rest_with(shared, seconds, *needed):
    time.sleep(seconds)


def finds_by(shared, finder):
    """Return whether modules are found by a finder of some class."""
    return any(type(each).__name__ == finder for each in sys.meta_path)


def end_process():
    os._exit(3)


class Missing:
    """Cannot be unpickled before its module was imported."""

    def __reduce__(self):
        return _import_missing, ()


def _import_missing():
    raise ModuleNotFoundError("No module named 'missing'")
