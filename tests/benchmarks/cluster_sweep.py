"""A sweep of 200 gaits of low effort on four Dask workers: ``python -m tests.benchmarks.cluster_sweep FILE [SECONDS]``.

With SECONDS a worker is killed every so many, in turn, in the middle of its tasks.  Prints, as JSON: seconds, and how
many workers were killed.
"""

import itertools
import json
import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from gaitopt import DaskExecutor, Execution, GaitProblem, Limits, MultipleShooting, compass_biped, sweep
from tests import dask

GAITS, WORKERS = 200, 4


def problem():
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.2,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=8),
    )


def killer(address, every, killed):
    """Kill a worker every so many seconds, in turn; nannies start new ones."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        for turn in itertools.count():
            time.sleep(every)
            processes = sorted(client.run(os.getpid, on_error="return").items())
            worker, process = processes[turn % len(processes)]
            if isinstance(process, int):
                os.kill(process, signal.SIGKILL)
                killed.append(worker)


def main(path, every):
    killed = []
    with (
        tempfile.TemporaryDirectory() as folder,
        dask.scheduler(Path(folder), allowed_failures=3) as (address, _),
        dask.workers(address, WORKERS),
        DaskExecutor(address) as cluster,
    ):
        if every:
            threading.Thread(target=killer, args=(address, every, killed), daemon=True).start()
        began = time.perf_counter()
        axis = np.linspace(0.12, 0.3, GAITS)
        found = sweep(problem(), {"friction": axis}, starts=1, path=path, execution=Execution(executor=cluster))
        print(json.dumps({"seconds": time.perf_counter() - began, "killed": len(killed)}), flush=True)
        assert found.attrs["complete"]
    os._exit(0)  # the killer sleeps


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 0.0)
