"""Workers of a command that computes many independent tasks: local processes or the workers of a Dask scheduler."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.parallel.dask_executor import DaskExecutor
    from gaitopt.parallel.execution import ActiveObserver, Execution, TaskObserver
    from gaitopt.parallel.shared_payload import Prepare


@dataclass(frozen=True)
class WorkerOptions:
    """Number of local processes, and the executor that is used instead, if any."""

    workers: int
    executor: "DaskExecutor | None" = None

    def execution(
        self,
        observer: "TaskObserver",
        prepare: "Prepare | None" = None,
        *,
        active_observer: "ActiveObserver | None" = None,
    ) -> "Execution":
        """Return the execution of a study by these workers."""
        from gaitopt.parallel.execution import Execution

        return Execution(
            workers=self.workers,
            executor=self.executor,
            prepare=prepare,
            observer=observer,
            active_observer=active_observer,
        )


@contextmanager
def worker_options(workers: int | None, scheduler: str | None) -> Iterator[WorkerOptions]:
    """Yield local processes, one per processor by default, or the connection to a scheduler.

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
            "--workers and --scheduler exclude each other: --workers is the number of local processes; "
            "the scheduler determines the number of its workers."
        )
    from gaitopt.parallel.dask_executor import DaskExecutor

    with DaskExecutor(scheduler) as executor:
        yield WorkerOptions(1, executor)
