"""Interrupts and time limits of solves of robots with several contacts."""

import math

import pytest

from gaitopt import Collocation, InputError, Ipopt, Status
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact import planar_solver
from tests.ocp.multicontact_examples import hop


def interrupter(number):
    """Return an observer that interrupts a solve of an NLP, counted from 1, and the list of solves that began."""
    began = []

    def observe(iteration):
        began.extend([iteration] if iteration.number == 0 else [])
        if len(began) == number:
            raise KeyboardInterrupt

    return observe, began


@pytest.mark.parametrize(("number", "kept"), [(1, False), (2, False), (3, True)])
def test_an_interrupt_on_any_grid_ends_the_solve(number, kept):
    """The third solve is on a finer grid; the solution of the second one is kept, and no other start is tried."""
    observe, began = interrupter(number)
    gait = solve_planar(hop(intervals=(4, 4)), starts=2, observer=observe)
    assert gait.status is Status.INTERRUPTED
    ending = "; the result is the solution before this refinement"
    assert gait.solver.message == "User_Requested_Stop" + ending * kept
    assert len(began) == number
    assert gait.solver.warnings == ()


def test_an_interrupt_while_a_refused_problem_is_evaluated_is_reported(monkeypatch):
    monkeypatch.setattr(planar_solver, "explain_planar_impossibility", lambda problem: "no equilibrium")
    gait = solve_planar(hop(intervals=(4, 4)))
    assert (gait.status, gait.solver.message) == (Status.INFEASIBLE, "no equilibrium")
    observe, _ = interrupter(1)
    monkeypatch.setattr(planar_solver, "silent", observe)  # a refused problem has no progress of iterations
    gait = solve_planar(hop(intervals=(4, 4)))
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.message == "User_Requested_Stop"


def test_an_interrupt_of_a_later_start_keeps_the_gait_found_before():
    problem = hop(intervals=(4, 4)).replace(transcription=Collocation(intervals=(4, 4), tolerance=math.inf))
    observe, began = interrupter(2)
    gait = solve_planar(problem, starts=3, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert len(began) == 2
    assert gait.solver.objective == pytest.approx(solve_planar(problem).solver.objective)


def test_a_time_limit_is_that_of_all_starts(monkeypatch):
    deadlines, solve_start = [], planar_solver._solve_start

    def record(problem, number, solver, observer):
        deadlines.append(solver.deadline())
        return solve_start(problem, number, solver, observer)

    monkeypatch.setattr(planar_solver, "_solve_start", record)
    problem = hop(intervals=(4, 4)).replace(transcription=Collocation(intervals=(4, 4), tolerance=math.inf))
    solve_planar(problem, starts=2, solver=Ipopt(time_limit=50.0))
    assert deadlines[0] == deadlines[1] < math.inf


@pytest.mark.parametrize("intervals", [0, (0, 8), -3])
def test_a_grid_without_intervals_is_refused(intervals):
    with pytest.raises(InputError, match="intervals must be "):
        hop(intervals=intervals)


def test_an_interrupt_between_two_grids_keeps_the_solution_on_the_last_one(monkeypatch):
    """While errors between nodes are evaluated, Python raises KeyboardInterrupt; no solver is at work."""
    problem = hop(intervals=(4, 4))
    coarse = solve_planar(problem.replace(transcription=Collocation(intervals=(4, 4), tolerance=math.inf)))

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(planar_solver, "refine_plan", interrupt)
    gait = solve_planar(problem, starts=2)
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.objective == pytest.approx(coarse.solver.objective, rel=1e-9)
    monkeypatch.setattr(planar_solver, "planar_start", interrupt)
    with pytest.raises(KeyboardInterrupt):  # there is no solution yet
        solve_planar(problem)
