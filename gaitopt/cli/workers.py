"""Options of commands that run many tasks: processes of this machine, or the workers of a Dask scheduler."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

import typer

from gaitopt.errors import InputError
from gaitopt.parallel.dask_executor import DaskExecutor
from gaitopt.parallel.execution import Execution, TaskObserver
from gaitopt.parallel.shared_payload import Prepare

Workers = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Number of worker processes (default: one per processor).", show_default=False),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of a Dask scheduler, such as tcp://host:8786, whose workers run the tasks instead.",
    ),
]


@dataclass(frozen=True)
class WorkerOptions:
    """Workers of a command."""

    workers: int
    executor: DaskExecutor | None = None

    def execution(self, observer: TaskObserver, prepare: Prepare | None = None) -> Execution:
        """Return the execution of a study by these workers."""
        return Execution(workers=self.workers, executor=self.executor, prepare=prepare, observer=observer)


@contextmanager
def worker_options(workers: int | None, scheduler: str | None) -> Iterator[WorkerOptions]:
    """Yield processes of this machine, one per processor unless a number is given, or a connection to a scheduler."""
    if scheduler is None:
        yield WorkerOptions(workers or os.cpu_count() or 1)
        return
    if workers is not None:
        raise InputError(
            "--workers applies to processes of this machine only; the scheduler determines the number of its workers. "
            "Give --workers or --scheduler."
        )
    with DaskExecutor(scheduler) as executor:
        yield WorkerOptions(1, executor)
