"""Executors of tasks: processes of this machine, or an executor that the user provides."""

import contextlib
import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Iterable
from concurrent.futures import BrokenExecutor, Executor, Future, InvalidStateError, wait
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any

from gaitopt.errors import GaitoptError
from gaitopt.interrupts import block_interrupts, defer_interrupt
from gaitopt.parallel.dask_executor import DaskExecutor
from gaitopt.parallel.payload_folder import PayloadFolder
from gaitopt.parallel.shared_payload import Prepare, SharedPayload, Work, call_in_worker, call_with_payload, init_worker

if TYPE_CHECKING:
    from loky import ProcessPoolExecutor

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

POLL_INTERVAL = 0.1
"""Time between two checks of whether anything still completes the tasks [s]."""

FEEDER_TIMEOUT = 1.0
"""Longest time that is waited for the thread that writes tasks to processes which are killed [s]."""

_STARTS = 3
"""Attempts to start workers that survive until their first task."""


class TaskExecutor(ABC):
    """Runs tasks one by one; a context that shuts its workers down."""

    most_deaths: int
    """Number of workers that one task, running alone, may terminate before it is abandoned."""

    @abstractmethod
    def workers(self) -> int:
        """Return the number of tasks that run at a time; raises GaitoptError if no worker is left."""

    @abstractmethod
    def capacity(self) -> int:
        """Return the number of tasks to submit at a time; raises GaitoptError if no worker is left."""

    @abstractmethod
    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Submit a task; raises BrokenExecutor if a worker has died."""

    @abstractmethod
    def fail_lost_tasks(self, futures: Iterable[Future]) -> None:
        """Fail the tasks that nothing completes any more, as if their workers had died."""

    @abstractmethod
    def restart(self) -> None:
        """Replace the workers after one has died."""

    @abstractmethod
    def shutdown(self, *, kill: bool) -> None:
        """End the workers, with `kill` in the middle of their tasks."""

    def __enter__(self) -> "TaskExecutor":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.shutdown(kill=kind is not None)


class LocalProcesses(TaskExecutor):
    """Processes of this machine with one thread of linear algebra each; Ctrl-C does not reach them.

    They exit when this process ends.  Processes are spawned: forking one with compiled code and threads is not safe.
    """

    most_deaths = 3

    def __init__(self, workers: int, work: Work, shared: Any, prepare: Prepare | None = None) -> None:
        from multiprocessing import Pipe, resource_tracker

        self._workers, self._work = workers, work
        payload = SharedPayload.pack(shared, prepare)
        self._digest, self._folder = payload.digest, PayloadFolder()
        # Workers read a file: one that died while it was sent much through a pipe would block this process for ever.
        self._file = self._folder.path / "payload.pickle"
        self._parent, self._own_end = Pipe(duplex=False)  # closes when this process ends
        try:
            self._file.write_bytes(payload.content)
        except OSError as error:
            self._remove_files()
            raise GaitoptError(f"Cannot write {self._file} for worker processes: {error.strerror or error}.") from error
        if os.name == "posix":
            resource_tracker.ensure_running()  # started later, in block_interrupts, it would lift the block
        self._pool = self._start_pool()

    def workers(self) -> int:
        """Return the number of processes."""
        return self._workers

    def capacity(self) -> int:
        """Return three tasks for two processes: few wait for this process, and few precede one that others wait for."""
        return self._workers + max(1, self._workers // 2)

    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Submit a task; raises BrokenExecutor if a worker has died."""
        with defer_interrupt(), block_interrupts():  # workers start with the first task
            return self._pool.submit(call_in_worker, self._work, self._digest, argument, needed)

    def fail_lost_tasks(self, futures: Iterable[Future]) -> None:
        """Fail the tasks of a pool whose manager thread has ended, as it may with insufficient memory.

        The thread alone passes results on; without it, all tasks would be waited for indefinitely.
        """
        manager = getattr(self._pool, "_executor_manager_thread", None)
        if manager is None or manager.is_alive():
            return
        for future in futures:
            with contextlib.suppress(InvalidStateError):  # it was completed at the last moment
                future.set_exception(BrokenExecutor("the thread that manages the workers has ended"))

    def restart(self) -> None:
        """Replace the workers; raises GaitoptError if they die before they do any task."""
        for _ in range(_STARTS):
            with defer_interrupt():
                self._end_pool(kill=True)
                self._pool = self._start_pool()
            try:
                with defer_interrupt(), block_interrupts():
                    first = self._pool.submit(os.getpid)
                while not wait([first], POLL_INTERVAL).done:
                    self.fail_lost_tasks([first])
                first.result()
                return
            except BrokenExecutor:
                continue
        raise GaitoptError(
            f"Worker processes ended {_STARTS} times in succession before they completed any task. If memory is "
            "insufficient, use fewer workers."
        )

    def shutdown(self, *, kill: bool) -> None:
        """End the processes, with `kill` in the middle of their tasks, and remove their files.

        Repeated interrupts are deferred: processes that are not completely shut down leave their semaphores, of which
        the resource tracker of loky warns.
        """
        with defer_interrupt():
            self._end_pool(kill=kill)
            self._remove_files()

    def _end_pool(self, *, kill: bool) -> None:
        """End the processes of the pool, and with `kill` the thread that writes tasks into their pipe.

        The thread waits while the pipe is full.  This process also has the end of the pipe that is read, so that the
        thread would wait indefinitely for killed processes, and its queue would never free its semaphores.
        """
        queue = getattr(self._pool, "_call_queue", None)
        self._pool.shutdown(kill_workers=kill)
        reader, feeder = getattr(queue, "_reader", None), getattr(queue, "_thread", None)
        if kill and reader is not None:
            reader.close()  # the thread ends with an error, which loky ignores
            if feeder is not None:
                feeder.join(FEEDER_TIMEOUT)

    def _start_pool(self) -> "ProcessPoolExecutor":
        from loky import ProcessPoolExecutor

        # That a pool has failed is reported by the error of its tasks, and not by a traceback besides.
        logging.getLogger("concurrent.futures").addFilter(_is_no_failure_of_a_pool)
        return ProcessPoolExecutor(
            self._workers,
            initializer=init_worker,
            initargs=(self._digest, self._file, self._parent),
            env=_worker_environment(),
        )

    def _remove_files(self) -> None:
        self._parent.close()
        self._own_end.close()
        self._folder.remove()


class ExternalExecutor(TaskExecutor):
    """An executor of the user, which starts, replaces and ends its workers by its own rules."""

    most_deaths = 1

    def __init__(
        self, executor: Executor, workers: int, work: Work, shared: Any, prepare: Prepare | None = None
    ) -> None:
        self._executor, self._workers = executor, workers
        self._task = partial(call_with_payload, work, SharedPayload.pack(shared, prepare))
        self._pending: set[Future] = set()
        self._dask = executor if isinstance(executor, DaskExecutor) else None

    def workers(self) -> int:
        """Return the number of workers; those of a Dask scheduler may come and go."""
        return max(1, self._workers if self._dask is None else self._dask.count_workers())

    def capacity(self) -> int:
        """Return two tasks for each worker."""
        return 2 * self.workers()

    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Submit a task."""
        future = self._executor.submit(self._task, argument, needed)
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def fail_lost_tasks(self, futures: Iterable[Future]) -> None:
        """Do nothing: the executor of the user completes its tasks."""

    def restart(self) -> None:
        """Do nothing for a Dask scheduler, which replaces its workers; raise GaitoptError for any other executor."""
        if self._dask is None:
            raise GaitoptError(
                "The executor has lost its workers. Completed results are saved in the output file if one was given; "
                "run the same study again to resume."
            )

    def shutdown(self, *, kill: bool) -> None:
        """Cancel the tasks that have not begun; the executor remains open."""
        for future in list(self._pending):
            future.cancel()


def _is_no_failure_of_a_pool(record: logging.LogRecord) -> bool:
    return not record.getMessage().startswith("Exception in executor manager thread")


def _worker_environment() -> dict[str, str]:
    """Return the environment variables that workers have besides ours."""
    threads = {name: "1" for name in _THREADS if name not in os.environ}
    # Compiled functions are kept for later tasks; loky takes that for a leak and would replace the worker.
    return threads | {"LOKY_MAX_MEMORY_LEAK_SIZE": "1e15"}
