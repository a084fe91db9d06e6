"""Execution of tasks: they are submitted to an executor, and their outcomes are yielded as they complete."""

import contextlib
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import Any, Protocol

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import InterruptRecord, defer_interrupt, hold_interrupt, record_interrupts
from gaitopt.parallel.execution import ActiveObserver, Execution, TaskObserver
from gaitopt.parallel.executors import POLL_INTERVAL, ExternalExecutor, LocalProcesses, TaskExecutor
from gaitopt.parallel.shared_payload import Work
from gaitopt.parallel.task_graph import Task, TaskOutcome, TaskQueue

Meanwhile = Callable[[Callable[[], None]], object]
"""Called with a function that raises KeyboardInterrupt after a Ctrl-C."""


@dataclass(frozen=True)
class TaskReport:
    """How the tasks of a study ended.

    Attributes
    ----------
    failures : dict of str to str
        Reasons of the tasks without a result by their keys.
    interrupted : bool
        Whether Ctrl-C was pressed, also if it came after the last task.
    """

    failures: dict[str, str]
    interrupted: bool = False


class ResultStore(Protocol):
    """Takes results by key, as a mutable mapping does."""

    def __contains__(self, key: object) -> bool: ...

    def __setitem__(self, key: str, result: Any) -> None: ...


def run_tasks(
    work: Work,
    tasks: Sequence[Task],
    shared: Any = None,
    *,
    known: Mapping[str, Any] | None = None,
    execution: Execution | None = None,
    meanwhile: Meanwhile | None = None,
) -> Generator[TaskOutcome, None, None]:
    """Yield the outcome of each task when it ends.

    The inputs of a task follow from the list alone, so results depend neither on the number of workers nor on which of
    them finishes first; only the order in which they come does.  Results that no later task needs are not kept in
    memory.

    Parameters
    ----------
    work : callable
        Called as ``work(shared, argument, *results needed)``.
    tasks : sequence of Task
        A task comes after those it needs; the first of those that may run is run first.
    shared : object
        Passed to every task; sent once to each worker.
    known : mapping of str to object, optional
        Results of an earlier run by key: these tasks are not run again, and not yielded.
    execution : Execution, optional
        Workers; with one and no executor, tasks run in this process.
    meanwhile : callable, optional
        Called once in this process when the first tasks are under way in workers, or before the first one, with a
        function that raises KeyboardInterrupt after a Ctrl-C.

    Yields
    ------
    TaskOutcome
        With `failure` set if the task's worker died repeatedly; tasks that need its result receive None.

    Raises
    ------
    InputError
        If a task comes before one it needs, or `shared` is not picklable.
    GaitoptError
        If no worker is left, or a worker cannot load `shared`.

    Examples
    --------
    >>> import math
    >>> [outcome.result for outcome in run_tasks(math.pow, [Task("square", 2), Task("cube", 3)], 10)]
    [100.0, 1000.0]
    """
    execution = execution or Execution()
    workers, prepare = execution.workers, execution.prepare
    queue = TaskQueue(tasks, known or {}, longest_first=workers > 1)
    if execution.executor is None and (workers == 1 or len(queue) <= 1):
        yield from _run_here(work, shared, queue, meanwhile, execution.active_observer)
        return
    with hold_interrupt() as interrupt, contextlib.ExitStack() as stack:
        executor: TaskExecutor
        with defer_interrupt():  # a second interrupt while the executor is prepared would leave files and semaphores
            if execution.executor is None:
                executor = LocalProcesses(workers, work, shared, prepare)
            else:
                executor = ExternalExecutor(execution.executor, workers, work, shared, prepare)
            stack.enter_context(executor)
        yield from _run_on(executor, queue, interrupt, meanwhile, execution)
    interrupt.check()  # an interrupt while the workers ended; raised now, it leaves none of their semaphores


def collect_tasks(
    running: Generator[TaskOutcome, None, None],
    results: ResultStore,
    planned: Sequence[Task],
    observer: TaskObserver | None,
    *,
    known_suffice: bool = False,
) -> TaskReport:
    """Store the results of tasks by key as they complete, until the last or an interrupt.

    An interrupt before the first outcome is raised: there is nothing to write.  If the results of an earlier run
    suffice for a report, it is raised only without any of them.

    Parameters
    ----------
    running : generator
        From :func:`run_tasks`.
    results : ResultStore
        A dict, for example; keys it holds already count as done.
    planned : sequence of Task
    observer : callable, optional
        Called with (tasks done, tasks in all).
    known_suffice : bool
        Whether the results of an earlier run suffice for a report.

    Raises
    ------
    KeyboardInterrupt
        If the interrupt comes before the first outcome.
    """
    failures: dict[str, str] = {}
    known = count = sum(task.key in results for task in planned)
    try:
        with contextlib.closing(running):
            for outcome in running:
                count += 1
                if outcome.failure:
                    failures[outcome.task.key] = outcome.failure
                else:
                    results[outcome.task.key] = outcome.result
                if observer is not None:
                    observer(count, len(planned))
    except KeyboardInterrupt:
        if count == (0 if known_suffice else known):
            raise
        return TaskReport(failures, interrupted=True)
    return TaskReport(failures)


def _run_here(
    work: Work, shared: Any, queue: TaskQueue, meanwhile: Meanwhile | None, active_observer: ActiveObserver | None
) -> Iterator[TaskOutcome]:
    """Do the tasks in this process; an interrupt that a task has lost is raised after it."""
    if meanwhile is not None and len(queue):
        with hold_interrupt() as interrupt:
            meanwhile(interrupt.check)
        interrupt.check()
    while (task := queue.next()) is not None:
        if active_observer is not None:
            active_observer((task.title,))
        with record_interrupts() as interrupt:
            try:
                result = work(shared, task.argument, *queue.needed_results(task))
            finally:
                interrupt.check()
        yield queue.finish(TaskOutcome(task, result))


def _run_on(
    executor: TaskExecutor,
    queue: TaskQueue,
    interrupt: InterruptRecord,
    meanwhile: Meanwhile | None,
    execution: Execution,
) -> Iterator[TaskOutcome]:
    """Keep an executor busy until no task is left.

    When a worker dies, any of the tasks under way may be the cause.  They are run again one at a time: a task that runs
    alone when its worker dies is the cause.
    """
    running: dict[Future, Task] = {}
    to_isolate: deque[Task] = deque()
    deaths: Counter[str] = Counter()
    while True:
        isolated = bool(to_isolate)
        while len(running) < (1 if isolated else executor.capacity()):
            task = to_isolate.popleft() if to_isolate else queue.next()
            if task is None:
                break
            running[_submit(executor, queue, task)] = task
        if execution.active_observer is not None:
            # Tasks are submitted in advance: the earliest ones run, the others wait for a worker.
            execution.active_observer(tuple(task.title for task in running.values())[: executor.workers()])
        if not running:
            interrupt.check()  # one during the last outcome: the workers need not be waited for
            return
        if meanwhile is not None:
            meanwhile(interrupt.check)
            meanwhile = None
        lost = []
        for future in _wait_for_any(executor, running, interrupt):
            task = running.pop(future)
            if _lost_its_worker(future):
                lost.append(task)
            else:
                yield queue.finish(TaskOutcome(task, future.result()))
        if lost:
            executor.restart()
            deaths.update(task.key for task in lost if isolated)
            if deaths[lost[0].key] >= executor.most_deaths:
                reason = "the task repeatedly terminated its worker process; memory may be insufficient"
                yield queue.finish(TaskOutcome(lost.pop(0), None, reason))
            to_isolate.extendleft(lost)


def _submit(executor: TaskExecutor, queue: TaskQueue, task: Task) -> Future:
    try:
        return executor.submit(task.argument, queue.needed_results(task))
    except BrokenExecutor as error:  # a worker died since the last check
        future: Future = Future()
        future.set_exception(error)
        return future


def _wait_for_any(executor: TaskExecutor, running: Mapping[Future, Task], interrupt: InterruptRecord) -> list[Future]:
    """Wait for one future at least, and return the finished ones, successes first, so that their results are stored.

    If a worker died, wait for all futures, which are lost with it or end in other workers.
    """
    ended = _wait(executor, running, FIRST_COMPLETED, interrupt)
    if any(map(_lost_its_worker, ended)):
        ended = _wait(executor, running, ALL_COMPLETED, interrupt)
    return sorted(ended, key=_has_failed)


def _wait(
    executor: TaskExecutor, running: Mapping[Future, Task], until: str, interrupt: InterruptRecord
) -> set[Future]:
    while True:
        now = wait(running, POLL_INTERVAL, until)
        interrupt.check()
        if not now.not_done or (until == FIRST_COMPLETED and now.done):
            return now.done
        executor.capacity()  # raises if no worker is left
        executor.fail_lost_tasks(now.not_done)


def _lost_its_worker(future: Future) -> bool:
    return future.cancelled() or isinstance(future.exception(), BrokenExecutor)


def _has_failed(future: Future) -> bool:
    return future.cancelled() or future.exception() is not None
