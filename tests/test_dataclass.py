"""Dataclasses of gaitopt behave as those of Python: each test runs with both decorators."""

import copy
import dataclasses
import inspect
import pickle
from dataclasses import FrozenInstanceError, asdict, field, fields, replace
from pathlib import Path
from typing import Any

import pytest

import gaitopt
from gaitopt.dataclass import dataclass as quick_dataclass

DECORATORS = [pytest.param(dataclasses.dataclass, id="python"), pytest.param(quick_dataclass, id="gaitopt")]


@quick_dataclass(frozen=True)
class Stored:
    """A class at the top of a module, as pickling requires."""

    name: str
    values: tuple[float, ...] = ()


def define_limb(dataclass: Any) -> Any:
    @dataclass(frozen=True)
    class Limb:
        length: float
        mass: float = 1.0
        label: str = field(default="", compare=False)
        notes: list[str] = field(default_factory=list, repr=False, compare=False)

    return Limb


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_instances_are_shown_compared_and_hashed_by_their_fields(dataclass: Any) -> None:
    limb = define_limb(dataclass)
    name = "define_limb.<locals>.Limb"
    assert repr(limb(0.5, label="a")) == f"{name}(length=0.5, mass=1.0, label='a')"
    assert limb(0.5, label="a") == limb(0.5, 1.0, "b") != limb(0.5, 2.0)
    assert hash(limb(0.5, label="a")) == hash((0.5, 1.0))
    assert limb(0.5) != define_limb(dataclass)(0.5)
    assert limb(0.5).__eq__((0.5, 1.0)) is NotImplemented
    assert limb.__match_args__ == ("length", "mass", "label", "notes")
    assert str(inspect.signature(limb)).startswith("(length: float, mass: float = 1.0, label: str = ''")
    assert limb.__eq__.__qualname__.endswith("Limb.__eq__")


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_fields_are_assigned_only_once(dataclass: Any) -> None:
    one = define_limb(dataclass)(0.5)
    for name in ("length", "notes", "unknown"):
        with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{name}'"):
            setattr(one, name, 1.0)
        with pytest.raises(FrozenInstanceError, match=f"cannot delete field '{name}'"):
            delattr(one, name)
    assert vars(one) == {"length": 0.5, "mass": 1.0, "label": "", "notes": []}


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_attributes_of_a_derived_class_can_be_assigned_but_not_the_fields(dataclass: Any) -> None:
    class Leg(define_limb(dataclass)):  # type: ignore[misc]
        pass

    leg = Leg(0.5)
    leg.colour = "red"
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'mass'"):
        leg.mass = 2.0
    del leg.colour
    assert "colour" not in vars(leg)
    assert leg == Leg(0.5) != define_limb(dataclass)(0.5)
    assert repr(leg).startswith(f"{Leg.__qualname__}(length=0.5")


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_derived_dataclasses_must_be_frozen(dataclass: Any) -> None:
    limb = define_limb(dataclass)

    @dataclass(frozen=True, kw_only=True)
    class Arm(limb):  # type: ignore[misc]
        reach: float

    arm = Arm(0.5, reach=0.7)
    assert (arm.mass, arm.reach) == (1.0, 0.7)
    assert arm == Arm(0.5, reach=0.7) != Arm(0.5, reach=0.8)
    with pytest.raises(FrozenInstanceError):
        arm.reach = 1.0
    with pytest.raises(TypeError, match="cannot inherit non-frozen dataclass from a frozen one"):
        dataclass(type("Soft", (limb,), {}))


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_methods_of_the_class_itself_are_kept(dataclass: Any) -> None:
    @dataclass(frozen=True)
    class Angle:
        degrees: float

        def __repr__(self) -> str:
            return f"{self.degrees} deg"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Angle) and (self.degrees - other.degrees) % 360 == 0

        def __hash__(self) -> int:
            return hash(self.degrees % 360)

    assert repr(Angle(10)) == "10 deg"
    assert Angle(10) == Angle(370)
    assert hash(Angle(10)) == hash(Angle(370))


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_without_eq_instances_are_compared_by_identity(dataclass: Any) -> None:
    @dataclass(frozen=True, eq=False, kw_only=True)
    class Table:
        rows: list[int]
        total: int = field(init=False)

        def __post_init__(self) -> None:
            object.__setattr__(self, "total", sum(self.rows))

    one = Table(rows=[1, 2])
    assert one.total == 3
    assert one != Table(rows=[1, 2])
    assert len({one, one, Table(rows=[1, 2])}) == 2
    with pytest.raises(TypeError, match="positional argument"):
        Table([1, 2])


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_a_record_that_contains_itself_can_be_shown(dataclass: Any) -> None:
    limb = define_limb(dataclass)
    children: list[Any] = []
    parent = limb(children)
    children.append(parent)
    assert "length=[...]" in repr(parent)


@pytest.mark.parametrize("dataclass", DECORATORS)
def test_other_kinds_of_dataclasses_are_those_of_python(dataclass: Any) -> None:
    @dataclass
    class Counter:
        count: int = 0

    @dataclass(frozen=True, order=True)
    class Place:
        row: int

    counter = Counter()
    counter.count += 1
    assert counter == Counter(1)
    assert Place(1) < Place(2)
    assert dataclasses.is_dataclass(Counter)


def test_instances_are_copied_replaced_and_pickled() -> None:
    one = Stored("a", (1.0,))
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == copy.copy(one) == one
    assert replace(one, name="b") == Stored("b", (1.0,))
    assert asdict(one) == {"name": "a", "values": (1.0,)}
    assert [entry.name for entry in fields(one)] == ["name", "values"]
    with pytest.raises(FrozenInstanceError):
        copy.copy(one).name = "b"  # type: ignore[misc]


def test_no_class_of_the_package_uses_the_decorator_of_python() -> None:
    """Importing the package takes as long as its classes take to be made."""
    folder = Path(gaitopt.__file__).parent
    sources = [path for path in folder.rglob("*.py") if path.name != "dataclass.py"]
    assert len(sources) > 500
    imports = [path for path in sources if "dataclasses import dataclass" in path.read_text(encoding="utf-8")]
    assert imports == []
