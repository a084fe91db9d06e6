"""Inaccurate plans: a solution that leads to one is refined once, and no further than refinement helps."""

import numpy as np
import pytest

from gaitopt import Collocation, Margins, Newton, Status, solve
from gaitopt.ocp.solution.grid_solve import GridSolution, SingleStart
from gaitopt.ocp.solution.inaccurate_plans import EQUAL_COST, InaccuratePlans
from gaitopt.ocp.solution.mesh_refinement import refine_mesh
from gaitopt.ocp.solution.trajectory import BetweenNodes
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.progress import silent


@pytest.fixture
def problem(reference_problem):
    # Four intervals of 190 ms and no margin: between the points at which it is held the force leaves the cone.
    coarse = Collocation(intervals=4, points=3, tolerance=0.1)
    return reference_problem(torque=60.0, friction=0.1, margins=Margins(cone=0), transcription=coarse)


def test_the_same_solution_is_not_refined_for_every_start(problem, monkeypatch):
    costs, starts, add, find = [], [], InaccuratePlans.add, InaccuratePlans.find

    def record(plans, solution, gait):
        if gait.status is Status.PLAN_INACCURATE:
            costs.append(solution.cost)
        add(plans, solution, gait)

    def look_up(plans, solution):
        starts.append(solution)
        return find(plans, solution)

    monkeypatch.setattr(InaccuratePlans, "add", record)
    monkeypatch.setattr(InaccuratePlans, "find", look_up)
    assert solve(problem).status is Status.PLAN_INACCURATE
    assert starts
    assert np.all(np.diff(sorted(costs)) > EQUAL_COST * min(costs))


@pytest.mark.parametrize(("after", "finest"), [(0.02, [8]), (0.005, [16])])
def test_doubling_continues_while_it_reduces_the_violation(problem, monkeypatch, after, finest):
    def check(solution):
        return BetweenNodes(drift=0.0, outside=0.01 if solution.method.intervals == 4 else after)

    monkeypatch.setattr(GridSolution, "between", property(check))
    gait = solve(problem, starts=1)
    assert gait.status is Status.PLAN_INACCURATE
    assert gait.problem["intervals"] == finest


def test_a_grid_has_at_most_four_times_the_intervals_of_the_problem(problem, monkeypatch):
    monkeypatch.setattr(GridSolution, "between", property(lambda one: BetweenNodes(0.0, 0.1 / one.method.intervals[0])))
    start = SingleStart(problem, LinearGuess(), Newton(), silent)
    eight = start.solve_on_grid(problem.transcription.replace_grid((8,)), None, 1e-6)
    assert eight.outcome.status is Status.SOLVED
    assert refine_mesh(start, eight).method.intervals == (16,)
