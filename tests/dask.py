"""Dask schedulers and workers as processes of this machine."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
QUIET = ["--no-dashboard"]


@contextmanager
def scheduler(folder, *, allowed_failures=0):
    """Yield the address and the process of a scheduler that repeats a task `allowed_failures` times if workers die."""
    file, settings = folder / "scheduler.json", {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(allowed_failures)}
    with _process("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", file, **settings) as process:
        deadline = time.monotonic() + 60
        while not file.exists() or not file.read_text():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        yield json.loads(file.read_text())["address"], process


@contextmanager
def workers(address, count):
    """Run workers, which are started again if they die."""
    with _process("worker", address, "--nworkers", str(count), "--nthreads", "1"):
        yield


@contextmanager
def _process(*command, **settings):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **settings}
    line = [sys.executable, "-m", "distributed.cli.dask_" + command[0], *command[1:], *QUIET]
    with subprocess.Popen(line, env=environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
