"""What a task of a sweep solves, and what it spares itself."""

from dataclasses import replace

import numpy as np
import pytest

import gaitopt.study.sweeps.sweep_task as module
from gaitopt import Collocation, LinearGuess, Status
from gaitopt.study.multistart import objective
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepPoint, SweepTask
from tests.study.conftest import quick_problem

BEFORE, BEHIND = SweepPoint(0, (0,)), SweepPoint(0, (1,))


def two_points(sequence, frictions):
    """Return a grid, and the forward gaits of its two points, the second continued from the first."""
    problem = quick_problem(sequence=sequence, objective="cost_of_transport", transcription=Collocation(intervals=20))
    grid = SweepGrid(problem, (problem.sequence,), {"friction": np.array(frictions)}, 1)
    first, second = (module.skip_refinement(grid.problem_at(point)) for point in (BEFORE, BEHIND))
    gait = module.solve_start(first, LinearGuess())
    return grid, gait, module.solve_start(second, gait)


@pytest.fixture(scope="module")
def jump():
    """Return two points of which the second, continued from the first, lands on another, cheaper branch."""
    return two_points("slip+ stick slip- | slip+", [0.11, 0.1166])


@pytest.fixture(scope="module")
def smooth():
    return two_points("stick | stick", [0.19, 0.196])


def backward(grid, first, second):
    """Return what is found at the first point from the second one."""
    duty = SweepTask("backward", BEFORE, (("backward", BEHIND), ("forward", BEFORE), ("cold", BEFORE)))
    return module.solve_task(grid, duty, second, first, first)


def test_the_way_back_from_another_branch_is_gone(jump):
    grid, first, second = jump
    assert objective(backward(grid, first, second)) < 0.999 * objective(first)


def test_the_way_back_along_the_same_branch_is_spared(smooth, monkeypatch):
    grid, first, second = smooth
    gone = module.solve_start(module.skip_refinement(grid.problem_at(BEFORE)), second)
    assert objective(gone) == pytest.approx(objective(first), rel=1e-6)
    monkeypatch.setattr(module, "solve_start", lambda *given: pytest.fail("solved"))
    assert backward(grid, first, second) is first


def test_a_failure_is_on_no_branch(smooth):
    grid, first, second = smooth
    here, there = (grid.problem_at(point) for point in (BEFORE, BEHIND))
    assert module.on_one_branch(here, first, there, second)
    assert not module.on_one_branch(here, replace(first, status=Status.INFEASIBLE), there, second)


def test_gaits_from_default_starts_are_continued_on_the_grid_of_the_problem():
    for intervals, expected in ((40, [40]), (20, [20])):
        problem = quick_problem(transcription=Collocation(intervals=intervals))
        grid = SweepGrid(problem, (problem.sequence,), {"friction": np.array([0.2])}, 1)
        assert module.solve_task(grid, SweepTask("cold", BEFORE)).problem["intervals"] == expected
