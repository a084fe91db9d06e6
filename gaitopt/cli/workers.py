"""Who does the work of a command that runs many: processes of this machine, or a cluster."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

import typer

from gaitopt.errors import InputError
from gaitopt.parallel.dask_executor import DaskCluster

Workers = Annotated[
    int | None, typer.Option(min=1, max=1024, help="Processes. [one for each processor]", show_default=False)
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Of a Dask scheduler, such as tcp://host:8786, whose workers do the work instead."
    ),
]


@dataclass(frozen=True)
class WorkerOptions:
    """What studies are told of it."""

    workers: int
    executor: DaskCluster | None = None


@contextmanager
def worker_options(workers: int | None, scheduler: str | None) -> Iterator[WorkerOptions]:
    """Yield processes of this machine, one for each processor unless said otherwise, or a connection to a cluster."""
    if scheduler is None:
        yield WorkerOptions(workers or os.cpu_count() or 1)
        return
    if workers is not None:
        raise InputError("Give --workers or --scheduler: how many workers a cluster has is its own affair.")
    with DaskCluster(scheduler) as cluster:
        yield WorkerOptions(1, cluster)
