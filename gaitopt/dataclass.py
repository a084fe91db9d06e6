"""Dataclasses that are made quickly: importing them would otherwise take a tenth of the time of a short solve."""

from dataclasses import FrozenInstanceError, fields
from dataclasses import dataclass as compile_dataclass
from inspect import getattr_static
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, TypeVar

C = TypeVar("C", bound=type)

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls: Any = None, /, **options: Any) -> Any:
        """Decorate a class as :func:`dataclasses.dataclass`; frozen classes get methods that need not be compiled.

        Python compiles six functions for every frozen dataclass.  Here it compiles ``__init__`` only; the others are
        closures over the names of the fields and do the same.  As the fields are assigned by ``__setattr__``, making
        an instance takes somewhat longer.  A frozen class whose base class is a frozen dataclass is compiled entirely.

        Examples
        --------
        >>> @dataclass(frozen=True)
        ... class Limb:
        ...     length: float
        ...     mass: float = 1.0
        >>> Limb(0.5), Limb(0.5) == Limb(0.5, mass=1.0)
        (Limb(length=0.5, mass=1.0), True)
        >>> Limb(0.5).mass = 2
        Traceback (most recent call last):
        ...
        dataclasses.FrozenInstanceError: cannot assign to field 'mass'
        """
        if cls is None:
            return lambda decorated: dataclass(decorated, **options)
        inherits = any(hasattr(base, "__dataclass_params__") for base in cls.__mro__[1:])
        if inherits or not options.get("frozen") or not options.keys() <= {"frozen", "eq", "kw_only"}:
            return compile_dataclass(cls, **options)
        return _freeze(cls, eq=options.get("eq", True), kw_only=options.get("kw_only", False))


def _freeze(cls: C, *, eq: bool, kw_only: bool) -> C:
    """Return a class with the methods of a frozen dataclass."""
    stated = set(vars(cls))
    compile_dataclass(cls, eq=False, repr=False, kw_only=kw_only)
    cls.__dataclass_params__.frozen = True  # type: ignore[attr-defined]  # so that derived classes must be frozen
    methods = _make_guards(cls)
    if "__repr__" not in stated:
        methods["__repr__"] = _make_repr(cls)
    if eq:
        methods |= {name: method for name, method in _make_comparison(cls).items() if name not in stated}
    for name, method in methods.items():
        method.__name__, method.__qualname__, method.__module__ = name, f"{cls.__qualname__}.{name}", cls.__module__
        setattr(cls, name, method)
    return cls


def _make_guards(cls: Any) -> dict[str, Any]:
    """Return methods by which each field is assigned once, by ``__init__``."""
    names = {entry.name for entry in fields(cls)}
    plain = {name for name in names if not hasattr(getattr_static(cls, name, None), "__set__")}

    def assign(self: object, name: str, value: object) -> None:
        stored = self.__dict__
        if name in plain and name not in stored:
            stored[name] = value
        elif name in names and name not in stored:
            object.__setattr__(self, name, value)
        elif type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        else:  # an attribute of a derived class
            super(cls, self).__setattr__(name, value)

    def delete(self: object, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": assign, "__delattr__": delete}


def _make_repr(cls: type) -> Any:
    """Return the method that shows the fields as they are given to the class."""
    shown = [entry.name for entry in fields(cls) if entry.repr]

    @recursive_repr()
    def describe(self: object) -> str:
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
        return f"{type(self).__qualname__}({values})"

    return describe


def _make_comparison(cls: type) -> dict[str, Any]:
    """Return the methods that compare two instances by their fields."""
    compared = [attrgetter(entry.name) for entry in fields(cls) if entry.compare]
    hashed = [attrgetter(entry.name) for entry in fields(cls) if (entry.compare if entry.hash is None else entry.hash)]

    def equal(self: object, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return tuple(read(self) for read in compared) == tuple(read(other) for read in compared)

    def digest(self: object) -> int:
        return hash(tuple(read(self) for read in hashed))

    return {"__eq__": equal, "__hash__": digest}
