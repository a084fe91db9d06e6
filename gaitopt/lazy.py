"""Fields of dataclasses that are worked out when first read."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeVar, overload

T = TypeVar("T")

_ONE_AT_A_TIME = threading.RLock()


@dataclass(frozen=True, eq=False)
class Deferred(Generic[T]):
    """A value that is not worked out yet: a function without arguments.

    Attributes
    ----------
    read : callable
    portable : bool
        Whether the function can be sent to another process, so that the value is not worked out for that.
    """

    read: Callable[[], T]
    portable: bool = False


class LazyField(Generic[T]):
    """A dataclass field that may be given as :class:`Deferred`, which is then called when the field is first read.

    Meant for what is costly and not always looked at; :class:`LazyRecord` makes such a dataclass fit for pickling.

    Parameters
    ----------
    default : optional
        Default of the field; without it the field must be given.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Report(LazyRecord):
    ...     size: LazyField[int] = LazyField()
    >>> Report(size=3).size, Report(size=Deferred(lambda: 1 + 3)).size
    (3, 4)
    """

    def __init__(self, *default: T) -> None:
        self._default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> T: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: object | None, owner: type) -> T:
        if instance is None:
            if not self._default:
                raise AttributeError(self._name)  # so a dataclass knows that there is no default
            return self._default[0]
        found = vars(instance)[self._name]
        if isinstance(found, Deferred):
            with _ONE_AT_A_TIME:  # a thread that waits here finds it done
                found = vars(instance)[self._name]
                if isinstance(found, Deferred):
                    found = vars(instance)[self._name] = found.read()
        value: T = found
        return value

    def __set__(self, instance: object, value: T | Deferred[T]) -> None:
        vars(instance)[self._name] = value


class LazyRecord:
    """A dataclass with fields of type :class:`LazyField`: what is pickled or copied is their values."""

    def __getstate__(self) -> dict[str, Any]:
        return {entry.name: self._portable(entry.name) for entry in fields(self)}  # type: ignore[arg-type]

    def _portable(self, name: str) -> Any:
        kept = vars(self)[name]
        return kept if isinstance(kept, Deferred) and kept.portable else getattr(self, name)
