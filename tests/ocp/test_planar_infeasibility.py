"""Infeasible problems of robots with several contacts: their conflicting limits, and plans that are not gaits."""

from dataclasses import replace

import pytest

from gaitopt import Status
from gaitopt.ocp import Collocation, PlanarLimits, solve_planar
from gaitopt.ocp.multicontact.planar_infeasibility import conclude_planar_failure
from gaitopt.ocp.multicontact.planar_solver import _Start
from gaitopt.ocp.nlp.ipopt import Ipopt
from tests.ocp.multicontact_examples import walk

WEAK = {"ankle A": 1.0, "hip": 1.0, "ankle B": 0.0}
"""Torque limits [N m] with which the walker does not reach its speed."""


@pytest.fixture(scope="module")
def refused():
    return solve_planar(weak_walk())


def weak_walk(**limits):
    limits = PlanarLimits(torque=WEAK | limits)
    return walk("foot A stick |", limits=limits, transcription=Collocation(intervals=10))


def test_an_infeasible_problem_names_the_conflicting_limits(refused):
    assert refused.status is Status.INFEASIBLE
    names = {conflict.name: conflict for conflict in refused.solver.conflicts}
    assert {*names} == {"torque limit of ankle A", "torque limit of hip"}
    for conflict in names.values():
        assert conflict.separable
        assert conflict.sufficient > conflict.limit == 1
        assert "N m would suffice" in str(conflict)


@pytest.mark.parametrize("actuator", ["ankle A", "hip"])
def test_relaxing_one_of_them_suffices_and_less_does_not(refused, actuator):
    (conflict,) = (each for each in refused.solver.conflicts if each.name.endswith(actuator))
    assert solve_planar(weak_walk(**{actuator: conflict.sufficient})).status.ok
    missing = 0.9 * (conflict.sufficient - conflict.limit)
    assert not solve_planar(weak_walk(**{actuator: conflict.limit + missing})).status.ok


def test_an_interrupt_of_the_search_for_conflicts_is_reported(refused):
    def stop(iteration):
        raise KeyboardInterrupt

    failure = refused.replace_fields(solver=refused.solver.replace_fields(conflicts=()))
    gait = conclude_planar_failure(weak_walk(), failure, Ipopt(), stop, solve_planar)
    assert gait.status is Status.INTERRUPTED


def test_a_plan_that_is_not_accurate_between_its_nodes_is_not_solved(monkeypatch):
    """If a finer grid has no solution, the plan keeps its error between nodes, and its status says so."""

    def solve_coarse_grid_only(start, problem, *arguments, is_near=False, **options):
        result = solve_grid(start, problem, *arguments, is_near=is_near, **options)
        status = Status.FAILED if is_near else result.outcome.status
        return replace(result, outcome=replace(result.outcome, status=status))

    solve_grid = _Start.solve
    monkeypatch.setattr(_Start, "solve", solve_coarse_grid_only)
    problem = walk("foot A stick |", transcription=Collocation(intervals=4, tolerance=1e-12))
    assert solve_planar(problem).status is Status.PLAN_INACCURATE
