import copy
import dataclasses
import inspect
import pickle
from typing import Any

import numpy as np
import pytest

from gaitopt.lazy import Deferred, LazyField, LazyRecord
from gaitopt.records import dataclass


@dataclass(frozen=True)
class Step:
    length: float
    name: str = "step"
    remark: str = dataclasses.field(default="", compare=False, repr=False)


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples(LazyRecord):
    values: Any
    size: LazyField[int] = LazyField()

    def __post_init__(self):
        object.__setattr__(self, "values", np.asarray(self.values))


@dataclass(frozen=True)
class Empty:
    pass


@dataclass(frozen=True)
class Chain:
    links: list[Any]

    def __eq__(self, other):
        return isinstance(other, Chain)

    def __repr__(self):
        return "a chain"


def standard(decorated):
    """Return the class as the standard library defines it."""
    body = {
        name: value
        for name, value in vars(decorated).items()
        if name in ("__annotations__", "__doc__", "__module__", "__qualname__", "name", "remark")
    }
    body["remark"] = dataclasses.field(default="", compare=False, repr=False)
    return dataclasses.dataclass(frozen=True)(type(decorated.__name__, (), body))


def test_a_record_is_that_of_the_standard_library():
    one, other = Step(0.4, remark="a"), standard(Step)(0.4, remark="a")
    assert repr(one) == repr(other)
    assert inspect.signature(Step) == inspect.signature(type(other))
    assert dataclasses.asdict(one) == dataclasses.asdict(other)
    assert hash(one) == hash(other)
    assert Step.__match_args__ == type(other).__match_args__
    assert Step.__dataclass_params__.frozen


def test_records_with_equal_fields_are_equal():
    assert Step(0.4, remark="a") == Step(0.4, remark="b")
    assert Step(0.4) != Step(0.5)
    assert Step(0.4) != standard(Step)(0.4)
    assert len({Step(0.4), Step(0.4, remark="b"), Step(0.5)}) == 2
    assert Empty() == Empty()
    assert hash(Empty()) == hash(Empty())
    assert Samples(values=[1], size=1) != Samples(values=[1], size=1)


def test_methods_of_the_class_are_kept():
    assert repr(Chain([])) == "a chain"
    assert Chain([]) == Chain([1])
    assert hash(Chain("ab")) == hash(Chain("ab"))  # that of the fields, as in the standard library


@pytest.mark.parametrize("name", ["length", "remark", "unknown"])
def test_a_record_does_not_change(name):
    step = Step(0.4)
    with pytest.raises(dataclasses.FrozenInstanceError, match=f"cannot assign to field '{name}'"):
        setattr(step, name, 0.5)
    with pytest.raises(dataclasses.FrozenInstanceError, match=f"cannot delete field '{name}'"):
        delattr(step, name)


def test_lazy_fields_and_initialisation_work():
    samples = Samples(values=[1.0, 2.0], size=Deferred(lambda: 2))
    assert samples.size == 2
    assert samples.values.shape == (2,)
    with pytest.raises(dataclasses.FrozenInstanceError):
        samples.size = 3
    with pytest.raises(TypeError, match="values"):
        Samples(size=1)
    with pytest.raises(TypeError):
        Samples([1], 2)


def test_copies_are_equal():
    step = Step(0.4, "a", "b")
    for again in (copy.copy(step), copy.deepcopy(step), pickle.loads(pickle.dumps(step)), dataclasses.replace(step)):
        assert again == step
        assert again.remark == "b"
        with pytest.raises(dataclasses.FrozenInstanceError):
            again.name = "c"


def test_classes_can_be_derived():
    @dataclasses.dataclass(frozen=True)
    class Standard(Step):
        height: float = 0.1

    @dataclass(frozen=True)
    class Record(Step):
        height: float = 0.1

    for kind in (Standard, Record):
        step = kind(0.4, height=0.2)
        assert (step.length, step.height) == (0.4, 0.2)
        assert step == kind(0.4, height=0.2)
        assert step != kind(0.4)
        for name in ("length", "height"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(step, name, 1.0)


def test_a_record_that_contains_itself_is_described():
    @dataclass(frozen=True)
    class Node:
        children: list[Any]

    node = Node([])
    node.children.append(node)
    assert repr(node).endswith("Node(children=[...])")
