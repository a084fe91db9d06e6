"""Frozen dataclasses that are defined in a quarter of the time.

:func:`dataclasses.dataclass` compiles up to six methods for each class; for the classes of a short solve this takes
longer than to build its NLP.  Here only ``__init__`` is compiled, and the classes share the other methods.
"""

import dataclasses
import reprlib
from collections.abc import Callable
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal, TypeVar

T = TypeVar("T")

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(*, frozen: Literal[True], eq: bool = True, kw_only: bool = False) -> Callable[[type[T]], type[T]]:
        """Return the decorator of a frozen dataclass, with the meaning of :func:`dataclasses.dataclass`.

        Parameters
        ----------
        frozen : True
            Stated as for any frozen dataclass, for the reader and for type checkers.
        eq : bool
            Whether instances with equal fields are equal.
        kw_only : bool
            Whether the fields are passed by name.

        Examples
        --------
        >>> @dataclass(frozen=True)
        ... class Step:
        ...     length: float
        >>> Step(0.4), Step(0.4) == Step(0.4)
        (Step(length=0.4), True)
        >>> Step(0.4).length = 0.5
        Traceback (most recent call last):
        ...
        dataclasses.FrozenInstanceError: cannot assign to field 'length'
        """

        def decorate(cls: type[T]) -> type[T]:
            if any(map(dataclasses.is_dataclass, cls.__mro__[1:])):  # whose methods would be mixed with these
                return dataclasses.dataclass(frozen=True, eq=eq, kw_only=kw_only)(cls)
            record = dataclasses.dataclass(eq=False, repr=False, kw_only=kw_only)(cls)
            record.__dataclass_params__.frozen = True  # so that frozen dataclasses can be derived from it
            methods = {"__setattr__": _set_once, "__delattr__": _refuse_deletion, "__repr__": _describe}
            if eq:
                methods |= _compare_fields(record)
            for name, method in methods.items():
                if vars(record).get(name) is None:  # of a class that defines __eq__ only, the hash is None
                    setattr(record, name, method)
            return record

        return decorate


def _set_once(self: Any, name: str, value: object) -> None:
    """Set a field that has no value yet, as ``__init__`` does; an object that is complete does not change."""
    if name in vars(self) or name not in self.__dataclass_fields__:
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
    object.__setattr__(self, name, value)


def _refuse_deletion(self: Any, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


@reprlib.recursive_repr()
def _describe(self: Any) -> str:
    values = (f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self) if field.repr)
    return f"{type(self).__qualname__}({', '.join(values)})"


def _compare_fields(record: Any) -> dict[str, Callable[..., Any]]:
    """Return the methods by which instances with equal fields are equal and have one hash."""
    entries = dataclasses.fields(record)
    compared = _read_fields([field.name for field in entries if field.compare])
    hashed = _read_fields([field.name for field in entries if (field.compare if field.hash is None else field.hash)])

    def equals(self: Any, other: object) -> bool:
        return compared(self) == compared(other) if other.__class__ is self.__class__ else NotImplemented

    return {"__eq__": equals, "__hash__": lambda self: hash(hashed(self))}


def _read_fields(names: list[str]) -> Callable[[object], tuple[Any, ...]]:
    """Return the function that reads some fields of an object, as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda record: tuple(getattr(record, name) for name in names)
