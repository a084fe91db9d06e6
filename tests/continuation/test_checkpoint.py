"""A trace that is interrupted continues to the same diagram, bit for bit."""

import json
import math

import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, rimless_wheel, trace
from gaitopt.continuation import Checkpoint, TraceOptions, diagram_dataset
from gaitopt.continuation.gait_family import GaitFamily

RANGE = {"friction": (1.0, 0.85)}
REQUEST = {"friction": [1.0, 0.85]}


class Stopped(Exception):
    """End of the process in the middle of a trace."""


@pytest.fixture(scope="module")
def wheel():
    return WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})


@pytest.fixture(scope="module")
def whole(wheel):
    return trace(wheel, RANGE)


@pytest.fixture
def evaluations(monkeypatch):
    """The number of derivatives that were computed."""
    counted, original = [0], GaitFamily.derivative

    def count(self, *arguments):
        counted[0] += 1
        return original(self, *arguments)

    monkeypatch.setattr(GaitFamily, "derivative", count)
    return counted


def follow_until(wheel, path, points):
    def stop(branch):
        if branch.values.size == points:
            raise Stopped

    with pytest.raises(Stopped), Checkpoint(path, REQUEST) as checkpoint:
        trace(wheel, RANGE, options=TraceOptions(checkpoint=checkpoint), observer=stop)


@pytest.mark.slow
def test_a_trace_continues_to_the_same_dataset(wheel, whole, tmp_path, evaluations):
    path = tmp_path / "wheel.checkpoint"
    follow_until(wheel, path, 6)
    follow_until(wheel, path, 9)
    first = evaluations[0]
    with Checkpoint(path, REQUEST) as checkpoint:
        assert checkpoint.stored >= 9
        diagram = trace(wheel, RANGE, options=TraceOptions(checkpoint=checkpoint))
    one, other = diagram_dataset(whole), diagram_dataset(diagram)
    assert one.identical(other)
    assert json.dumps(diagram.records()) == json.dumps(whole.records())
    evaluations[0] = 0
    with Checkpoint(path, REQUEST) as checkpoint:
        again = trace(wheel, RANGE, options=TraceOptions(checkpoint=checkpoint))
        checkpoint.delete()
    assert diagram_dataset(again).identical(one)
    assert evaluations[0] < first / 10  # the whole trace was read
    assert not path.exists()


def test_an_incomplete_last_line_is_computed_again(wheel, whole, tmp_path):
    path = tmp_path / "wheel.checkpoint"
    follow_until(wheel, path, 5)
    path.write_text(path.read_text()[:-20])
    with Checkpoint(path, REQUEST) as checkpoint:
        diagram = trace(wheel, RANGE, options=TraceOptions(checkpoint=checkpoint))
    assert diagram_dataset(whole).identical(diagram_dataset(diagram))


def test_corrections_of_another_start_are_discarded(wheel, whole, tmp_path):
    path = tmp_path / "wheel.checkpoint"
    with Checkpoint(path, REQUEST) as checkpoint:
        for _ in range(3):
            checkpoint.record(np.zeros(3), np.ones(3), None)
    with Checkpoint(path, REQUEST) as checkpoint:
        assert checkpoint.stored == 3
        diagram = trace(wheel, RANGE, options=TraceOptions(checkpoint=checkpoint))
    assert diagram_dataset(whole).identical(diagram_dataset(diagram))
    assert all(json.loads(line)["point"] is not None for line in path.read_text().splitlines()[1:4])


def test_the_checkpoint_of_another_trace_is_not_overwritten(tmp_path):
    path = tmp_path / "wheel.checkpoint"
    with Checkpoint(path, REQUEST):
        pass
    with pytest.raises(InputError, match="belongs to another trace; delete it"):
        Checkpoint(path, {"friction": [1.0, 0.3]})
    assert path.exists()
    with pytest.raises(InputError, match="is not writable"):
        Checkpoint(tmp_path / "none" / "wheel.checkpoint", REQUEST)


@pytest.mark.parametrize("failed", [0, 1])
def test_an_error_before_the_first_solution_leaves_no_file(tmp_path, failed):
    path = tmp_path / "wheel.checkpoint"

    def refuse():
        with Checkpoint(path, {"friction": [2, 3]}) as checkpoint:
            assert path.exists()
            for _ in range(failed):
                checkpoint.record(np.zeros(2), np.ones(2), None)
            raise InputError("The range does not contain the start.")

    with pytest.raises(InputError, match="does not contain the start"):
        refuse()
    assert not path.exists()
