"""Workers of a command that computes many independent tasks: local processes or a cluster."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from gaitopt.errors import InputError
from gaitopt.parallel.dask_executor import DaskCluster


@dataclass(frozen=True)
class WorkerOptions:
    """Number of local processes, and the cluster that is used instead, if any."""

    workers: int
    executor: DaskCluster | None = None


@contextmanager
def worker_options(workers: int | None, scheduler: str | None) -> Iterator[WorkerOptions]:
    """Yield local processes, one per processor by default, or the connection to a cluster.

    Raises
    ------
    InputError
        If both are given.
    """
    if scheduler is None:
        yield WorkerOptions(workers or os.cpu_count() or 1)
        return
    if workers is not None:
        raise InputError(
            "Give --workers or --scheduler, not both: --workers is the number of local processes; "
            "the scheduler determines the number of cluster workers."
        )
    with DaskCluster(scheduler) as cluster:
        yield WorkerOptions(1, cluster)
