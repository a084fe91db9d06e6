"""Tasks: pieces of work with names, and the order in which they may run."""

import heapq
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gaitopt.errors import InputError


@dataclass(frozen=True, eq=False)
class Task:
    """A piece of work with a name of its own.

    Attributes
    ----------
    key : str
        Its name, unique among the tasks run together.
    argument : object
        Anything that can be pickled.
    needs : tuple of str
        Keys of earlier tasks, whose results it is given in this order.
    """

    key: str
    argument: Any = None
    needs: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Done:
    """A task that has ended: with its result, or with the reason why there is none."""

    task: Task
    result: Any
    failure: str = ""


class TaskQueue:
    """Which tasks may run now, which wait for others, and the results that are still needed.

    Tasks that only serve others, all of whose results are known, are left out.

    Parameters
    ----------
    tasks : sequence of Task
        A task comes after those it needs.
    known : mapping of str to object
        Results of tasks that ran before and are not to run again.

    Raises
    ------
    InputError
        If two tasks share a key, or one needs a task that does not come before it.

    Examples
    --------
    >>> first, second = Task("first"), Task("second", needs=("first",))
    >>> agenda = TaskQueue([first, second], {})
    >>> agenda.next() is first, agenda.next()
    (True, None)
    >>> done = agenda.finish(Done(first, 3))
    >>> agenda.next() is second, agenda.needed(second)
    (True, [3])
    """

    def __init__(self, tasks: Sequence[Task], known: Mapping[str, Any]) -> None:
        _check_order(tasks)
        self._tasks = _wanted(tasks, known)
        self._waiting: dict[str, list[int]] = {}  # places of the tasks that wait for a key
        self._uses = Counter(need for task in self._tasks for need in task.needs)
        self._open = [len(task.needs) for task in self._tasks]
        self._ready = [number for number, count in enumerate(self._open) if not count]
        self._results: dict[str, Any] = {}
        for number, task in enumerate(self._tasks):
            for need in task.needs:
                self._waiting.setdefault(need, []).append(number)
        for key in self._waiting.keys() & known.keys():
            self._release(key, known[key])

    def __len__(self) -> int:
        return len(self._tasks)

    def next(self) -> Task | None:
        """Take the first task of the list that may run; None when every task is taken or waits."""
        return self._tasks[heapq.heappop(self._ready)] if self._ready else None

    def needed(self, task: Task) -> list[Any]:
        """Return the results a task is given."""
        return [self._results[need] for need in task.needs]

    def finish(self, done: Done) -> Done:
        """Let the tasks run that waited for one that has ended, forget what nobody needs any more, return the same."""
        self._release(done.task.key, done.result)
        for need in done.task.needs:
            self._uses[need] -= 1
            if not self._uses[need]:
                del self._results[need]
        return done

    def _release(self, key: str, result: Any) -> None:
        if self._uses[key]:
            self._results[key] = result
        for number in self._waiting.get(key, ()):
            self._open[number] -= 1
            if not self._open[number]:
                heapq.heappush(self._ready, number)


def _wanted(tasks: Sequence[Task], known: Mapping[str, Any]) -> list[Task]:
    """Return the tasks to run: unknown, and either of use by themselves or for another one that is to run."""
    serving = {need for task in tasks for need in task.needs}
    wanted: list[Task] = []
    used: set[str] = set()
    for task in reversed(tasks):
        if task.key not in known and (task.key not in serving or task.key in used):
            wanted.append(task)
            used.update(task.needs)
    return wanted[::-1]


def _check_order(tasks: Sequence[Task]) -> None:
    seen: set[str] = set()
    for task in tasks:
        if task.key in seen:
            raise InputError(f"Two tasks are called {task.key!r}.")
        missing = [need for need in task.needs if need not in seen]
        if missing:
            raise InputError(f"Task {task.key!r} needs {missing[0]!r}, which does not come before it.")
        seen.add(task.key)
