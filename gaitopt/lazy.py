"""Fields of dataclasses that are evaluated when they are first read."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, Generic, Self, TypeVar, overload

from gaitopt.locks import ONE_AT_A_TIME

T = TypeVar("T")


class Deferred(Generic[T]):
    """A value that is not evaluated yet: a function without arguments.

    Attributes
    ----------
    read : callable
    portable : bool
        Whether the function can be sent to another process, so that the value need not be evaluated before.
    begin : callable or None
        Begins work in another thread that the function waits for, so that it takes less time.
    elsewhere : callable or None
        Returns the value in another process, to which it can be sent; it may take longer.
    """

    __slots__ = ("begin", "elsewhere", "portable", "read")

    def __init__(
        self,
        read: Callable[[], T],
        portable: bool = False,
        *,
        begin: Callable[[], None] | None = None,
        elsewhere: Callable[[], T] | None = None,
    ) -> None:
        self.read, self.portable, self.begin, self.elsewhere = read, portable, begin, elsewhere


class LazyField(Generic[T]):
    """A dataclass field whose value may be a :class:`Deferred`, which is evaluated when the field is first read.

    It serves values that are costly and not always used; :class:`LazyRecord` makes such a dataclass picklable.

    Parameters
    ----------
    default : optional
        Default of the field; without it the field is required.

    Examples
    --------
    >>> from gaitopt.dataclass import dataclass
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
        stored = vars(instance)[self._name]
        if isinstance(stored, Deferred):
            with ONE_AT_A_TIME:  # a thread that has waited for the lock reads the value
                stored = vars(instance)[self._name]
                if isinstance(stored, Deferred):
                    stored = vars(instance)[self._name] = stored.read()
        value: T = stored
        return value

    def __set__(self, instance: object, value: T | Deferred[T]) -> None:
        vars(instance)[self._name] = value


def is_evaluated(record: object, name: str) -> bool:
    """Return whether a lazy field has been read, or was given as a value.

    Examples
    --------
    >>> from gaitopt.dataclass import dataclass
    >>> @dataclass(frozen=True)
    ... class Report:
    ...     size: LazyField[int] = LazyField()
    >>> report = Report(size=Deferred(lambda: 4))
    >>> is_evaluated(report, "size"), report.size, is_evaluated(report, "size")
    (False, 4, True)
    """
    return not isinstance(vars(record)[name], Deferred)


class LazyRecord:
    """A dataclass with fields of type :class:`LazyField`, which are evaluated before it is pickled or copied."""

    def replace_fields(self, **changes: Any) -> Self:
        """Return the record with some fields changed; unlike :func:`dataclasses.replace` it evaluates no other field.

        Examples
        --------
        >>> from gaitopt.dataclass import dataclass
        >>> @dataclass(frozen=True)
        ... class Report(LazyRecord):
        ...     name: str
        ...     size: LazyField[int] = LazyField()
        >>> Report(name="a", size=Deferred(lambda: 1 / 0)).replace_fields(name="b").name
        'b'
        """
        stored = {entry.name: vars(self)[entry.name] for entry in fields(self)}  # type: ignore[arg-type]
        return type(self)(**{**stored, **changes})

    def begin_evaluation(self, name: str) -> None:
        """Begin to evaluate a field in another thread if it can be; it is evaluated when it is first read.

        Examples
        --------
        >>> from gaitopt.dataclass import dataclass
        >>> @dataclass(frozen=True)
        ... class Report(LazyRecord):
        ...     size: LazyField[int] = LazyField()
        >>> Report(size=Deferred(lambda: 4, begin=lambda: print("begun"))).begin_evaluation("size")
        begun
        """
        stored = vars(self)[name]
        if isinstance(stored, Deferred) and stored.begin is not None:
            with ONE_AT_A_TIME:
                stored.begin()

    def postpone_evaluation(self) -> Self:
        """Return the record that another process evaluates, as far as possible, if it is pickled before it is read.

        Examples
        --------
        >>> from gaitopt.dataclass import dataclass
        >>> @dataclass(frozen=True)
        ... class Report(LazyRecord):
        ...     size: LazyField[int] = LazyField()
        >>> report = Report(size=Deferred(lambda: 1 / 0, elsewhere=int)).postpone_evaluation()
        >>> is_evaluated(report, "size"), report.size
        (False, 0)
        """
        stored = {entry.name: vars(self)[entry.name] for entry in fields(self)}  # type: ignore[arg-type]
        return self.replace_fields(
            **{
                name: Deferred(value.elsewhere, portable=True)
                for name, value in stored.items()
                if isinstance(value, Deferred) and value.elsewhere is not None
            }
        )

    def __getstate__(self) -> dict[str, Any]:
        return {entry.name: self._portable(entry.name) for entry in fields(self)}  # type: ignore[arg-type]

    def _portable(self, name: str) -> Any:
        kept = vars(self)[name]
        return kept if isinstance(kept, Deferred) and kept.portable else getattr(self, name)
