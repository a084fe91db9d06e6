"""The one way to run many: tasks go to a crew, and their results come back as they are finished."""

import contextlib
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any

from gaitopt.study.crew import Crew, Foreign, Prepare, Processes, Work
from gaitopt.study.task import Agenda, Done, Task

Observer = Callable[[int, int], None]
"""Called with (tasks done, tasks in all)."""

MOST_DEATHS = 3
"""A task that has cost so many workers their lives, alone, is given up."""


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
        Runs the tasks instead of own processes, `workers` of them at a time.
    prepare : callable, optional
        Called once in each own process before `shared` is unpacked there, to import what it needs.

    Yields
    ------
    Done
        With `failure` set if the task's worker died again and again; tasks that need its result are given None.

    Raises
    ------
    InputError
        If tasks are in no order, or `shared` cannot be sent to a process.

    Examples
    --------
    >>> import math
    >>> [done.result for done in run_tasks(math.pow, [Task("square", 2), Task("cube", 3)], 10)]
    [100.0, 1000.0]
    """
    agenda = Agenda(tasks, known or {})
    if executor is None and (workers <= 1 or len(agenda) <= 1):
        while (task := agenda.next()) is not None:
            yield agenda.finish(Done(task, work(shared, task.argument, *agenda.needed(task))))
        return
    crew: Crew = Foreign(executor, workers, work, shared) if executor else Processes(workers, work, shared, prepare)
    with crew:
        yield from _led(crew, agenda)


def collect_tasks(
    running: Generator[Done, None, None],
    kept: MutableMapping[str, Any],
    planned: Sequence[Task],
    observer: Observer | None,
) -> dict[str, str]:
    """Keep the results of tasks by key as they come, until all have or an interrupt; return those lost, with reasons.

    Parameters
    ----------
    running : generator
        From :func:`run_tasks`.
    kept : mutable mapping
        What is there already counts as done.
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


def _led(crew: Crew, agenda: Agenda) -> Iterator[Done]:
    """Keep a crew busy until nothing is left to do.

    When a worker dies, nobody knows over which of the tasks at hand.  They are tried again one at a time: a task that
    is alone when its worker dies is the guilty one.
    """
    running: dict[Future, Task] = {}
    suspects: deque[Task] = deque()
    deaths: Counter[str] = Counter()
    while True:
        alone = bool(suspects)
        while len(running) < (1 if alone else crew.room):
            task = suspects.popleft() if suspects else agenda.next()
            if task is None:
                break
            running[_submitted(crew, agenda, task)] = task
        if not running:
            return
        lost = []
        for future in _ended(running):
            task = running.pop(future)
            if isinstance(future.exception(), BrokenExecutor):
                lost.append(task)
            else:
                yield agenda.finish(Done(task, future.result()))
        if lost:
            crew.renew()
            deaths.update(task.key for task in lost if alone)
            if deaths[lost[0].key] >= MOST_DEATHS:
                reason = f"the process that worked on it died {MOST_DEATHS} times; memory may be short"
                yield agenda.finish(Done(lost.pop(0), None, reason))
            suspects.extendleft(lost)


def _submitted(crew: Crew, agenda: Agenda, task: Task) -> Future:
    try:
        return crew.submit(task.argument, agenda.needed(task))
    except BrokenExecutor as error:  # a worker died since the last look
        future: Future = Future()
        future.set_exception(error)
        return future


def _ended(running: Mapping[Future, Task]) -> set[Future]:
    """Wait for a future at least; when its worker died, for all, which are lost with it or ended just before."""
    ended = wait(running, return_when=FIRST_COMPLETED).done
    if any(isinstance(future.exception(), BrokenExecutor) for future in ended):
        ended = wait(running).done
    return ended
