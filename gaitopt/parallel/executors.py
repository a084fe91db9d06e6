"""Crews: who does the tasks, own processes, somebody else's executor or a cluster."""

import os
import signal
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any

from gaitopt.errors import GaitoptError
from gaitopt.parallel.dask_executor import DaskCluster
from gaitopt.parallel.shared_payload import Prepare, SharedPayload, Work, call, call_with_payload, init_worker

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class WorkerPool(ABC):
    """Takes tasks one by one; a context that ends with everybody sent home."""

    most_deaths: int
    """How often workers may die of a task, alone, before it is given up."""

    @abstractmethod
    def room(self) -> int:
        """Return how many tasks are worth handing over at once; raises GaitoptError if there is nobody left."""

    @abstractmethod
    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Hand over a task."""

    @abstractmethod
    def renew(self) -> None:
        """Replace the crew after a worker died."""

    @abstractmethod
    def dismiss(self, *, at_once: bool) -> None:
        """Send everybody home, in the middle of their tasks if `at_once`."""

    def __enter__(self) -> "WorkerPool":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.dismiss(at_once=kind is not None)


class ProcessPool(WorkerPool):
    """Fresh processes of this machine, one thread of linear algebra each, deaf to Ctrl-C, gone when we are gone.

    Forking a process that holds compiled code and threads is not safe, so they are spawned.
    """

    most_deaths = 3

    def __init__(self, workers: int, work: Work, shared: Any, prepare: Prepare | None = None) -> None:
        self._workers, self._work, self._prepare = workers, work, prepare
        parcel = SharedPayload.of(shared)
        self._digest, self._folder = parcel.digest, tempfile.TemporaryDirectory(prefix="gaitopt-")
        self._file = Path(self._folder.name) / "shared.pickle"
        self._file.write_bytes(parcel.content)
        self._pool = self._open()

    def room(self) -> int:
        """Return two tasks for each process, so that none waits for us."""
        return 2 * self._workers

    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Hand over a task; raises BrokenProcessPool if a worker has died."""
        with _undisturbed():  # a worker is started when there is work for it
            return self._pool.submit(call, self._work, self._digest, argument, needed)

    def renew(self) -> None:
        """Start anew; raises GaitoptError if processes die whatever they do."""
        for _ in range(3):
            self._end(at_once=True)
            self._pool = self._open()
            try:
                with _undisturbed():
                    first = self._pool.submit(os.getpid)
                first.result()
                return
            except BrokenProcessPool:
                continue
        raise GaitoptError(
            "Worker processes die before they do anything. In a script of your own, start the study under "
            "'if __name__ == \"__main__\":'; if memory is short, use fewer workers."
        )

    def dismiss(self, *, at_once: bool) -> None:
        """End the processes, killing them if `at_once`, and clear away what was laid out for them."""
        self._end(at_once=at_once)
        self._folder.cleanup()

    def _end(self, *, at_once: bool) -> None:
        processes = dict(self._pool._processes or {}) if at_once else {}  # there is no public way to end a running task
        self._pool.shutdown(wait=not at_once, cancel_futures=True)
        for process in processes.values():
            process.kill()
        for process in processes.values():
            process.join()

    def _open(self) -> ProcessPoolExecutor:
        # A process that dies while much is being told to it leaves us waiting for ever: it reads a file instead.
        settings = (self._prepare, self._digest, self._file)
        return ProcessPoolExecutor(self._workers, get_context("spawn"), initializer=init_worker, initargs=settings)


class ExternalPool(WorkerPool):
    """An executor of the user's, which starts, loses and ends its workers by its own rules."""

    most_deaths = 1

    def __init__(
        self, executor: Executor, workers: int, work: Work, shared: Any, prepare: Prepare | None = None
    ) -> None:
        self._executor, self._workers = executor, workers
        self._task = partial(call_with_payload, work, SharedPayload.of(shared), prepare)
        self._pending: set[Future] = set()
        self._cluster = executor if isinstance(executor, DaskCluster) else None

    def room(self) -> int:
        """Return two tasks for each worker; those of a cluster may come and go, and new ones are awaited."""
        return 2 * max(1, self._workers if self._cluster is None else self._cluster.workers())

    def submit(self, argument: Any, needed: list[Any]) -> Future:
        """Hand over a task."""
        future = self._executor.submit(self._task, argument, needed)
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def renew(self) -> None:
        """Leave it to a cluster to replace its workers; give up otherwise: only its owner can mend an executor."""
        if self._cluster is None:
            raise GaitoptError(
                "The executor has lost its workers. A study with an output file has kept what was finished: run the "
                "same again to go on."
            )

    def dismiss(self, *, at_once: bool) -> None:
        """Cancel what has not begun; the executor stays open."""
        for future in list(self._pending):
            future.cancel()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Start processes that the terminal's Ctrl-C does not reach and whose linear algebra keeps to one thread.

    Both are inherited: the mask of blocked signals, and the environment.
    """
    added = [name for name in _THREADS if name not in os.environ]
    masks = hasattr(signal, "pthread_sigmask")
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else None
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
        if former is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, former)
