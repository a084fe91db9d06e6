"""Fields that are worked out when first read."""

import copy
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, asdict, dataclass, replace

import pytest

from gaitopt.lazy import Deferred, LazyField, LazyRecord, is_evaluated


@dataclass(frozen=True)
class Report(LazyRecord):
    size: LazyField[int] = LazyField()
    name: LazyField[str] = LazyField("none")


def counting():
    calls = []

    def read():
        calls.append(1)
        return 7

    return calls, Report(size=Deferred(read))


def test_a_value_is_worked_out_once_and_not_before_it_is_read():
    calls, report = counting()
    assert calls == []
    assert (report.size, report.size, len(calls)) == (7, 7, 1)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one)), replace])
def test_copies_hold_the_value(copied):
    calls, report = counting()
    other = copied(report)
    assert (other.size, other.name, len(calls)) == (7, "none", 1)
    assert other == Report(7, "none")


def test_another_process_may_evaluate_a_value():
    calls = []
    report = Report(size=Deferred(lambda: calls.append(1), elsewhere=int), name=Deferred(lambda: "one"))
    other = pickle.loads(pickle.dumps(report.postpone_evaluation()))
    assert calls == []
    assert [is_evaluated(other, name) for name in ("size", "name")] == [False, True]
    assert (other.size, other.name) == (0, "one")


def test_it_is_a_field_like_others():
    assert asdict(counting()[1]) == {"size": 7, "name": "none"}
    assert repr(counting()[1]) == "Report(size=7, name='none')"
    with pytest.raises(TypeError, match="size"):
        Report()
    with pytest.raises(FrozenInstanceError):
        Report(3).size = 4


def test_a_failure_is_met_again_at_the_next_reading():
    report = Report(size=Deferred(lambda: 1 // 0))
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            _ = report.size


def test_threads_share_one_working_out():
    calls, gate = [], threading.Barrier(4, timeout=10)
    report = Report(size=Deferred(lambda: calls.append(1) or len(calls)))

    def read(_):
        gate.wait()
        return report.size

    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(read, range(4))) == {1}


def test_other_fields_are_not_read_when_one_is_replaced():
    calls, report = counting()
    other = report.replace_fields(name="other")
    assert (other.name, calls) == ("other", [])
    assert (other.size, calls) == (7, [1])


def test_an_evaluation_begins_before_it_is_read():
    begun = []
    report = Report(size=Deferred(lambda: len(begun), begin=lambda: begun.append(1)), name=Deferred(lambda: "plain"))
    report.begin_evaluation("size")
    assert begun == [1]
    assert report.size == 1
    report.begin_evaluation("size")  # known already
    report.begin_evaluation("name")  # nothing to begin
    assert (report.name, begun) == ("plain", [1])
