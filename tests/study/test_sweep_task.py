"""What a task of a sweep solves, and what it spares itself."""

import itertools
import pickle
from dataclasses import replace

import numpy as np
import pytest

import gaitopt.study.sweeps.sweep_task as module
from gaitopt import Collocation, Ipopt, LinearGuess, Status
from gaitopt.lazy import is_evaluated
from gaitopt.ocp.solution.node_placement import distribute_nodes, find_ramps
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
    """Return two points of which the second, continued from the first, converges to another branch of lower cost."""
    return two_points("slip+ stick | slip+", [0.115, 0.1216])


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


def test_a_gait_that_only_serves_others_is_sent_without_its_motion(smooth):
    """Another process restores the motion if it is needed; what is continued from the gait is the same."""
    grid = smooth[0]
    first = module.solve_task(grid, SweepTask("cold", BEFORE))
    sent = pickle.loads(pickle.dumps(module.solve_unstored_task(grid, SweepTask("cold", BEFORE))))
    assert not is_evaluated(sent, "motion")
    assert not is_evaluated(sent.solver, "warnings")
    duty = SweepTask("forward", BEHIND, (("forward", BEFORE),))
    one, other = (module.solve_task(grid, duty, gait) for gait in (first, sent))
    assert not is_evaluated(sent, "motion")
    for former, now in ((first, sent), (one, other)):
        assert former.solver.objective == now.solver.objective
        for segment, again in zip(former.motion.segments, now.motion.segments, strict=True):
            assert np.array_equal(segment.q, again.q)
        assert (former.solver.error_between_nodes, former.solver.warnings) == (
            now.solver.error_between_nodes,
            now.solver.warnings,
        )
    point = SweepTask("point", BEFORE, (("forward", BEFORE), ("backward", BEFORE)))
    assert is_evaluated(pickle.loads(pickle.dumps(module.solve_unstored_task(grid, point, sent, sent))), "motion")


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


@pytest.fixture(scope="module")
def placed():
    """Return two points on the default grid, and the gait of the first one from its default start."""
    problem = quick_problem(objective="cost_of_transport", transcription=Collocation())
    grid = SweepGrid(problem, (problem.sequence,), {"friction": np.linspace(0.1, 0.13, 6)}, 1)
    return grid, module.solve_task(grid, SweepTask("cold", BEFORE))


def continue_forward(grid, gait, before=BEFORE, point=BEHIND):
    return module.solve_task(grid, SweepTask("forward", point, (("forward", before),)), gait)


def test_nodes_follow_the_torques_from_point_to_point(placed, monkeypatch):
    """The nodes are moved to the jumps of the neighbour, and the known gait still needs no interior-point method."""
    monkeypatch.setattr(Ipopt, "minimise", lambda *given: pytest.fail("Ipopt was called"))
    grid, gait = placed
    for before, point in itertools.pairwise(grid.points()):
        following = continue_forward(grid, gait, before, point)
        assert following.status is Status.SOLVED
        expected = distribute_nodes(find_ramps(gait.solution), gait.solution.intervals)
        np.testing.assert_allclose(following.solution.fractions[0], expected[0], atol=1e-12)
        gait = following


def test_the_estimate_of_the_cost_error_goes_along(placed):
    """No point is refined only because a single grid is known: its nodes and the estimate are those of its chain."""
    grid, gait = placed
    following = continue_forward(grid, gait)
    assert following.solution.cost_factor == gait.solution.cost_factor > 0
    known = SweepTask("point", BEHIND, (("forward", BEHIND), ("backward", BEHIND)))
    best = module.solve_task(grid, known, following, following)
    assert best.verification.passed
    assert best.solution.fractions == following.solution.fractions
    assert 0 < best.solver.cost_error <= 0.003
    exact = module.solve_start(grid.problem_at(BEHIND).replace(transcription=Collocation(intervals=160)), best)
    assert objective(best) <= 1.003 * objective(exact)


def test_another_candidate_is_solved_only_if_the_best_one_fails(smooth, monkeypatch):
    grid, first, _ = smooth
    task = SweepTask("point", BEFORE, (("forward", BEFORE), ("backward", BEFORE)))
    other = replace(first, solver=first.solver.replace_fields(objective=1.01 * objective(first)))
    solved, solve_start = [], module.solve_start

    def record(problem, start, *solver):
        solved.append(start)
        return solve_start(problem, start, *solver)

    monkeypatch.setattr(module, "solve_start", record)
    assert module.solve_task(grid, task, other, first).verification.passed
    assert solved == [first]
    verify_by_cost, failed = module.verify_by_cost, []

    def fail_first(problem, gaits):
        result = verify_by_cost(problem, gaits)
        if failed:
            return result
        failed.append(result)
        return replace(result, status=Status.UNCONFIRMED)

    monkeypatch.setattr(module, "verify_by_cost", fail_first)
    solved.clear()
    assert module.solve_task(grid, task, other, first).verification.passed
    assert solved == [first, other]


def test_branches_are_told_apart_beyond_the_errors_of_their_grids(smooth):
    """A difference of 0.1 % is another branch on a stated grid, but not where both costs may be off by as much."""
    grid, first, second = smooth
    higher = first.replace_fields(
        solver=first.solver.replace_fields(objective=1.001 * objective(first), cost_error=0.001)
    )
    near = second.replace_fields(solver=second.solver.replace_fields(cost_error=0.001))
    here, there = (grid.problem_at(point) for point in (BEFORE, BEHIND))
    assert not module.on_one_branch(here, higher, there, near)
    stated = Collocation(intervals=20, cost_tolerance=0.003)
    here, there = (problem.replace(transcription=stated) for problem in (here, there))
    assert module.on_one_branch(here, higher, there, near)
