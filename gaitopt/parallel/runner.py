"""The one way to run many: tasks go to a crew, and their results come back as they are finished."""

import contextlib
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ALL_COMPLETED, FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any, Protocol

from gaitopt.parallel.deferred_interrupt import DeferredInterrupt
from gaitopt.parallel.executors import ExternalPool, ProcessPool, WorkerPool
from gaitopt.parallel.shared_payload import Prepare, Work
from gaitopt.parallel.task_graph import Done, Task, TaskQueue
from gaitopt.parameters import Parameter

PULSE = 0.5
"""How often the crew is looked after, and an interrupt answered, while tasks are under way [s]."""

Observer = Callable[[int, int], None]
"""Called with (tasks done, tasks in all)."""


class Keeper(Protocol):
    """Takes results in by key, as a mutable mapping does."""

    def __contains__(self, key: object) -> bool: ...

    def __setitem__(self, key: str, result: Any) -> None: ...


def run_tasks(
    work: Work,
    tasks: Sequence[Task],
    shared: Any = None,
    *,
    known: Mapping[str, Any] | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    prepare: Prepare | None = None,
) -> Generator[Done, None, None]:
    """Yield each task when it has ended.

    What a task is given is decided by the list alone, so that results depend neither on the number of workers nor on
    who finishes first; only the order in which they come does.  What no later task needs is not held in memory.

    Parameters
    ----------
    work : callable
        A module's function, called as ``work(shared, argument, *results needed)``.
    tasks : sequence of Task
        A task comes after those it needs; of those that may run the first goes first.
    shared : object
        What every task is given; sent once to each worker.
    known : mapping of str to object, optional
        Results of an earlier run by key: these tasks are not run again, and not yielded.
    workers : int
        Processes; with 1 everything is done in this one.
    executor : concurrent.futures.Executor, optional
        Runs the tasks instead of own processes: a :class:`DaskCluster`, all its workers, or any other, `workers` tasks
        at a time.
    prepare : callable, optional
        Called in each process before `shared` is unpacked there, to import what it needs.

    Yields
    ------
    Done
        With `failure` set if the task's worker died again and again; tasks that need its result are given None.

    Raises
    ------
    InputError
        If there are no workers, tasks are in no order, or `shared` cannot be sent to a process.
    GaitoptError
        If nobody is left to do the tasks.

    Examples
    --------
    >>> import math
    >>> [done.result for done in run_tasks(math.pow, [Task("square", 2), Task("cube", 3)], 10)]
    [100.0, 1000.0]
    """
    Parameter("workers", 1, "1", "", lower=1, whole=True).check(workers)
    agenda = TaskQueue(tasks, known or {})
    if executor is None and (workers == 1 or len(agenda) <= 1):
        while (task := agenda.next()) is not None:
            yield agenda.finish(Done(task, work(shared, task.argument, *agenda.needed(task))))
        return
    crew: WorkerPool
    if executor is None:
        crew = ProcessPool(workers, work, shared, prepare)
    else:
        crew = ExternalPool(executor, workers, work, shared, prepare)
    with crew, DeferredInterrupt() as interrupt:
        yield from _led(crew, agenda, interrupt)


def collect_tasks(
    running: Generator[Done, None, None],
    kept: Keeper,
    planned: Sequence[Task],
    observer: Observer | None,
) -> dict[str, str]:
    """Keep the results of tasks by key as they come, until all have or an interrupt; return those lost, with reasons.

    Parameters
    ----------
    running : generator
        From :func:`run_tasks`.
    kept : Keeper
        A dict, for example; what is there already counts as done.
    planned : sequence of Task
    observer : callable, optional
        Called with (tasks done, tasks in all).
    """
    lost: dict[str, str] = {}
    count = sum(task.key in kept for task in planned)
    with contextlib.closing(running), contextlib.suppress(KeyboardInterrupt):
        for done in running:
            if done.failure:
                lost[done.task.key] = done.failure
            else:
                kept[done.task.key] = done.result
            count += 1
            if observer is not None:
                observer(count, len(planned))
    return lost


def _led(crew: WorkerPool, agenda: TaskQueue, interrupt: DeferredInterrupt) -> Iterator[Done]:
    """Keep a crew busy until nothing is left to do.

    When a worker dies, nobody knows over which of the tasks at hand.  They are tried again one at a time: a task that
    is alone when its worker dies is the guilty one.
    """
    running: dict[Future, Task] = {}
    suspects: deque[Task] = deque()
    deaths: Counter[str] = Counter()
    while True:
        alone = bool(suspects)
        while len(running) < (1 if alone else crew.room()):
            task = suspects.popleft() if suspects else agenda.next()
            if task is None:
                break
            running[_submitted(crew, agenda, task)] = task
        if not running:
            return
        lost = []
        for future in _ended(crew, running, interrupt):
            task = running.pop(future)
            if _broken(future):
                lost.append(task)
            else:
                yield agenda.finish(Done(task, future.result()))
        if lost:
            crew.renew()
            deaths.update(task.key for task in lost if alone)
            if deaths[lost[0].key] >= crew.most_deaths:
                reason = "process after process died of it; memory may be short"
                yield agenda.finish(Done(lost.pop(0), None, reason))
            suspects.extendleft(lost)


def _submitted(crew: WorkerPool, agenda: TaskQueue, task: Task) -> Future:
    try:
        return crew.submit(task.argument, agenda.needed(task))
    except BrokenExecutor as error:  # a worker died since the last look
        future: Future = Future()
        future.set_exception(error)
        return future


def _ended(crew: WorkerPool, running: Mapping[Future, Task], interrupt: DeferredInterrupt) -> list[Future]:
    """Wait for a future at least, and return what has ended, successes first: they are kept whatever comes after.

    When a worker died all futures are waited for, which are lost with it, or end elsewhere.
    """
    ended = _waited(crew, running, FIRST_COMPLETED, interrupt)
    if any(map(_broken, ended)):
        ended = _waited(crew, running, ALL_COMPLETED, interrupt)
    return sorted(ended, key=_failed)


def _waited(crew: WorkerPool, running: Mapping[Future, Task], until: str, interrupt: DeferredInterrupt) -> set[Future]:
    while True:
        now = wait(running, PULSE, until)
        interrupt.answer()
        if not now.not_done or (until == FIRST_COMPLETED and now.done):
            return now.done
        crew.room()  # raises if there is nobody left


def _broken(future: Future) -> bool:
    """Whether a future ended because its worker did."""
    return future.cancelled() or isinstance(future.exception(), BrokenExecutor)


def _failed(future: Future) -> bool:
    return future.cancelled() or future.exception() is not None
