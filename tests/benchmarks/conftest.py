"""Where benchmarks leave their numbers: ``docs/benchmarks.json``, from which the page in the docs is written."""

import datetime
import json
import os
import platform
import time
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

collect_ignore_glob = ["plain_*.py", "bare_*.py"]
"""Scripts of other tools are run by the benchmarks, where those tools are installed; they hold no tests."""

RESULTS = Path(__file__).parents[2] / "docs" / "benchmarks.json"


@pytest.fixture(scope="session")
def record():
    """Return a function that files the numbers of one benchmark, with versions and date."""

    def file(section, numbers, packages=()):
        known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
        names = ("gaitopt", "casadi", "numpy", "scipy", *packages)
        known[section] = {
            "date": datetime.date.today().isoformat(),
            "python": platform.python_version(),
            "machine": f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}",
            "versions": {name: metadata.version(name) for name in names},
            "numbers": numbers,
        }
        RESULTS.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")

    return file


def timed(work):
    """Return the processor's seconds and the clock's seconds some work takes, and its result.

    On a machine that others use too, the processor's seconds are what can be compared.
    """
    clock, began = time.perf_counter(), time.process_time()
    result = work()
    return time.process_time() - began, time.perf_counter() - clock, result


def spread(values):
    """Return lower quartile, median and upper quartile."""
    return [float(value) for value in np.quantile(values, (0.25, 0.5, 0.75))]


def ratios(own, others):
    """Return the spread of the ratios of interleaved measurements."""
    return spread(np.asarray(own) / np.asarray(others))
