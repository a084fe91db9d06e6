"""Threads, forked and spawned processes that solve and simulate at the same time agree with one thread."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import warnings
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np

from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, simulate, solve, verify

warnings.simplefilter("ignore", DeprecationWarning)  # of a fork with threads
NUMBERS = range(8)


def work(number):
    problem = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.14 + 0.01 * number, speed=0.633, step_length=0.4713,
        limits=Limits(torque=6), objective="torque_squared", transcription=MultipleShooting(intervals=10),
    )
    gait = verify(solve(problem))
    q, v = np.array([0, 0, -0.1478369, -0.1478369]), np.array([0, 0, 0.7327968 + 1e-4 * number, -0.5006679])
    walk = simulate(compass_biped(), q, v, {"slope": np.deg2rad(1), "friction": 0.3})
    return gait.status.key, gait.solver.objective, gait.motion.period, walk.motion.period


def work_in_processes(method):
    with ProcessPoolExecutor(2, get_context(method)) as pool:
        return list(pool.map(work, NUMBERS))


def work_in_threads():
    with ThreadPoolExecutor(8) as pool:
        return list(pool.map(work, NUMBERS))


if __name__ == "__main__":
    results = {"threads": work_in_threads(), "fork after threads": work_in_processes("fork")}
    alone = list(map(work, NUMBERS))
    results |= {"fork": work_in_processes("fork"), "spawn": work_in_processes("spawn"), "again": work_in_threads()}
    assert len(set(alone)) == len(alone) and {row[0] for row in alone} == {"solved"}, alone
    print([name for name, found in results.items() if found != alone])
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_threads_and_processes_agree_with_one_thread(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, "-X", "faulthandler", script]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "[]\n", "")
