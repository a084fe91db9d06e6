"""Locks that a forked process can acquire although a thread of its parent held them, and the lock of expressions.

CasADi releases Python's lock in every call, but the reference counts of its SX nodes and its table of constants are not
protected: two threads that build, or one that builds and one that deletes, expressions at the same time can crash the
process.
"""

import functools
import os
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any, ParamSpec, TypeVar, cast, overload

P = ParamSpec("P")
T = TypeVar("T")


class ForkSafeLock:
    """A reentrant lock, which is free in a process that was forked while another thread held it.

    Examples
    --------
    >>> lock = ForkSafeLock()
    >>> with lock, lock:
    ...     pass
    """

    def __init__(self) -> None:
        self._lock, self._acquired = threading.RLock(), _LocksOfThread()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._renew)

    def _renew(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        lock = self._lock
        lock.acquire()
        self._acquired.locks.append(lock)

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._acquired.locks.pop().release()  # that of the parent, in a process forked in the block


class _LocksOfThread(threading.local):
    """The locks that a thread holds, the last one acquired at the end."""

    def __init__(self) -> None:
        self.locks = list[threading.RLock]()


ONE_AT_A_TIME = ForkSafeLock()
"""Lock of all work with expressions, and of all solves: Ipopt with MUMPS is not thread-safe, either."""


def one_at_a_time(function: Callable[P, T]) -> Callable[P, T]:
    """Return a function that builds expressions, with the lock of expressions held during each call.

    Examples
    --------
    >>> one_at_a_time(abs)(-1)
    1
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        with ONE_AT_A_TIME:
            return function(*args, **kwargs)

    return call


class cached_property(functools.cached_property[T]):
    """A cached property that may build expressions.

    That of Python 3.11 holds another lock: a thread that waits in it for the lock of expressions, and a thread that has
    this one and waits for the property, would wait for ever.
    """

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "cached_property[T]": ...
    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> T: ...
    def __get__(self, instance: object | None, owner: type[Any] | None = None) -> Any:
        if instance is None:
            return self
        with ONE_AT_A_TIME:
            values, name = vars(instance), cast("str", self.attrname)
            if name not in values:
                values[name] = self.func(instance)
            return values[name]
