"""Execution: the workers that run the tasks of a study, and the observer of their progress."""

from collections.abc import Callable
from concurrent.futures import Executor

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.parallel.shared_payload import Prepare
from gaitopt.parameters import callable_with, instance_of, optional, whole_number

TaskObserver = Callable[[int, int], None]
"""Called with (tasks done, tasks in all)."""

ActiveObserver = Callable[[tuple[str, ...]], None]
"""Called with the names of the tasks under way."""


@check_arguments
@frozen(kw_only=True)
class Execution:
    """How the tasks of a study are executed; its results do not depend on it.

    Attributes
    ----------
    workers : int
        Number of worker processes; with 1 all tasks run in this process.  With an executor: tasks submitted at a time.
    executor : concurrent.futures.Executor, optional
        Runs the tasks instead of processes of this machine: a :class:`DaskExecutor`, which knows its number of workers,
        or any other.
    prepare : callable, optional
        Called without arguments in each worker before the problem is unpickled there, to import what it needs.
    observer : callable, optional
        Called with (tasks done, tasks in all) in this process.
    active_observer : callable, optional
        Called in this process with the names of the tasks under way, one for each worker, when they change.

    Raises
    ------
    InputError
        If an attribute has a value or type that is not accepted.

    Examples
    --------
    >>> Execution(workers=4).workers
    4
    """

    workers: int = field(default=1, validator=whole_number())
    executor: Executor | None = field(
        default=None, validator=optional(instance_of(Executor, example="a concurrent.futures.Executor"))
    )
    prepare: Prepare | None = field(default=None, validator=optional(callable_with("no arguments")))
    observer: TaskObserver | None = field(
        default=None, validator=optional(callable_with("the number of tasks done and the number of all tasks"))
    )
    active_observer: ActiveObserver | None = field(
        default=None, validator=optional(callable_with("the names of the tasks under way"))
    )
