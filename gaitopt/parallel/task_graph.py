"""Tasks: pieces of work with names, and the order in which they may run."""

import heapq
from collections import Counter
from collections.abc import Mapping, Sequence
from graphlib import TopologicalSorter
from typing import Any

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError


@dataclass(frozen=True, eq=False)
class Task:
    """A named piece of work.

    Attributes
    ----------
    key : str
        Its name, unique among the tasks run together.
    argument : object
        Anything that can be pickled.
    needs : tuple of str
        Keys of earlier tasks, whose results are passed to it in this order.
    label : str
        Its name in displays of progress; the key by default.
    """

    key: str
    argument: Any = None
    needs: tuple[str, ...] = ()
    label: str = ""

    @property
    def title(self) -> str:
        """Name in displays of progress."""
        return self.label or self.key


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """A task that has ended: with its result or the reason of its failure."""

    task: Task
    result: Any
    failure: str = ""


class TaskQueue:
    """Tasks in the order in which they may run, and the results that later ones need.

    Tasks that only serve others, all of whose results are known, are left out.

    Parameters
    ----------
    tasks : sequence of Task
        A task comes after those it needs.
    known : mapping of str to object
        Results of tasks that ran before and are not to run again.
    longest_first : bool
        Take the task first on which the longest chain of others depends, so that workers do not wait for that chain at
        the end; by default the tasks that may run are taken in the order of the list.

    Raises
    ------
    InputError
        If two tasks share a key, or one needs a task that does not come before it.

    Examples
    --------
    >>> first, second = Task("first"), Task("second", needs=("first",))
    >>> queue = TaskQueue([first, second], {})
    >>> queue.next() is first, queue.next()
    (True, None)
    >>> outcome = queue.finish(TaskOutcome(first, 3))
    >>> queue.next() is second, queue.needed_results(second)
    (True, [3])
    """

    def __init__(self, tasks: Sequence[Task], known: Mapping[str, Any], *, longest_first: bool = False) -> None:
        _check_order(tasks)
        self._tasks = _required_tasks(tasks, known)
        self._places = {task.key: place for place, task in enumerate(self._tasks)}
        self._lengths = _chain_lengths(self._tasks) if longest_first else Counter[str]()
        self._ready: list[tuple[int, int]] = []  # negative chain lengths and places of tasks that may run, a heap
        self._uses = Counter(need for task in self._tasks for need in task.needs)
        self._results = {key: known[key] for key in self._uses if key in known}
        self._graph = TopologicalSorter(
            {task.key: [need for need in task.needs if need in self._places] for task in self._tasks}
        )
        self._graph.prepare()

    def __len__(self) -> int:
        return len(self._tasks)

    def next(self) -> Task | None:
        """Take a task that may run; None if every task is taken or waits for others."""
        for key in self._graph.get_ready():
            heapq.heappush(self._ready, (-self._lengths[key], self._places[key]))
        return self._tasks[heapq.heappop(self._ready)[1]] if self._ready else None

    def needed_results(self, task: Task) -> list[Any]:
        """Return the results that a task needs, in the order of its `needs`."""
        return [self._results[need] for need in task.needs]

    def finish(self, outcome: TaskOutcome) -> TaskOutcome:
        """Release the tasks that waited for one that has ended, drop results no longer needed; return the outcome."""
        task = outcome.task
        self._graph.done(task.key)
        if self._uses[task.key]:
            self._results[task.key] = outcome.result
        for need in task.needs:
            self._uses[need] -= 1
            if not self._uses[need]:
                del self._results[need]
        return outcome


def _chain_lengths(tasks: Sequence[Task]) -> Counter[str]:
    """Return by key the number of tasks in the longest chain of those that depend on a task one after another."""
    lengths = Counter[str]()
    for task in reversed(tasks):
        for need in task.needs:
            lengths[need] = max(lengths[need], lengths[task.key] + 1)
    return lengths


def _required_tasks(tasks: Sequence[Task], known: Mapping[str, Any]) -> list[Task]:
    """Return the tasks to run: unknown, and either of use by themselves or needed by another one that is to run."""
    serving = {need for task in tasks for need in task.needs}
    required: list[Task] = []
    used: set[str] = set()
    for task in reversed(tasks):
        if task.key not in known and (task.key not in serving or task.key in used):
            required.append(task)
            used.update(task.needs)
    return required[::-1]


def _check_order(tasks: Sequence[Task]) -> None:
    seen: set[str] = set()
    for task in tasks:
        if task.key in seen:
            raise InputError(f"Two tasks have the key {task.key!r}; keys must be unique.")
        missing = [need for need in task.needs if need not in seen]
        if missing:
            raise InputError(f"Task {task.key!r} needs {missing[0]!r}, which does not precede it.")
        seen.add(task.key)
