"""Difficult problems end soon with a gait that replays, or with the reason why none exists."""

import itertools
import math

import pytest

from gaitopt import Collocation, Ipopt, Limits, Margins, Status, solve, verify
from gaitopt.ocp.nlp import ipopt

STICK, SLIP, REVERSAL = "stick | stick", "slip+ stick | slip+", "slip+ slip- | slip+"
HIDDEN = "slip+ stick slip- | slip+"
SMOOTH = {"objective": "torque_squared"}


def count_iterations(problem, **options):
    """Return the gait of a problem and the number of iterations of all its solves."""
    counter = itertools.count()
    return solve(problem, observer=lambda step: next(counter), **options), next(counter)


@pytest.mark.parametrize(("sequence", "friction"), [(SLIP, 0.8), ("stick slip- | stick", 1.0)])
def test_a_slip_near_the_paradox_is_infeasible(reference_problem, sequence, friction):
    """Elastic problems did not converge: accelerations are unbounded where slip is not well posed."""
    problem = reference_problem(sequence=sequence, friction=friction, torque=60.0, **SMOOTH)
    gait, iterations = count_iterations(problem)
    assert gait.status is Status.INFEASIBLE
    assert "step_length" in {conflict.setting for conflict in gait.solver.conflicts}
    assert iterations < 700


def test_a_stick_at_high_friction_is_solved(reference_problem):
    gait = solve(reference_problem(sequence=STICK, friction=0.8, torque=60.0))
    assert verify(gait).status is Status.SOLVED


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_a_slip_without_least_speed_is_a_gait_or_an_inaccurate_plan(reference_problem, sequence):
    gait = solve(reference_problem(sequence=sequence, margins=Margins(slip_speed=0), **SMOOTH))
    if gait.status.ok:
        assert verify(gait).status is Status.SOLVED
    else:
        assert gait.status is Status.PLAN_INACCURATE
        assert gait.solver.warnings


def test_a_direct_reversal_needs_more_torque(reference_problem):
    problem = reference_problem(sequence=REVERSAL, **SMOOTH)
    gait, iterations = count_iterations(problem)
    assert gait.status is Status.INFEASIBLE
    assert iterations < 300
    needed = {conflict.name: conflict.sufficient for conflict in gait.solver.conflicts}
    assert set(needed) == {"torque limit of ankle", "torque limit of hip"}
    limits = Limits(torque={"ankle": 6.0, "hip": needed["torque limit of hip"]})
    assert verify(solve(problem.replace(limits=limits))).status is Status.SOLVED


def test_the_hidden_gait_exists_with_twelve_newton_metres(reference_problem):
    problem = reference_problem(sequence=HIDDEN, friction=0.25, torque=12.0, **SMOOTH)
    assert verify(solve(problem)).status is Status.SOLVED


@pytest.mark.slow
def test_a_problem_that_is_feasible_on_the_coarse_grid_alone_is_infeasible(reference_problem):
    """The coarse grid needs 6.3 N m; the iterations on the fine grid were repeated from each of four starts."""
    limits = Limits(torque={"ankle": 6.317, "hip": 6.0})
    gait, iterations = count_iterations(reference_problem(sequence=HIDDEN, friction=0.25, limits=limits, **SMOOTH))
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.message.startswith("no feasible motion found near the solution on a coarse grid")
    assert gait.solver.conflicts
    assert iterations < 500


def test_the_conclusion_lists_what_is_exceeded_if_conflicts_are_not_isolated(reference_problem):
    from gaitopt.ocp.solution.infeasibility import conclude_failure
    from gaitopt.ocp.statement.initial_guess import LinearGuess

    problem = reference_problem(torque=0.3, transcription=Collocation(intervals=10, tolerance=math.inf), **SMOOTH)
    isolated = solve(problem)
    counts = []
    concluded = conclude_failure(
        problem,
        isolated,
        [LinearGuess()],
        Ipopt(),
        lambda step: counts.append(step.number == 0),
        isolate_conflicts=False,
    )
    assert concluded.status is Status.INFEASIBLE
    assert sum(counts) == 1
    listed = {conflict.name for conflict in concluded.solver.conflicts}
    assert listed >= {conflict.name for conflict in isolated.solver.conflicts}


@pytest.fixture
def clock(monkeypatch):
    """Replace the clock of the solvers by one that advances by a second with every reading."""
    seconds = itertools.count()
    monkeypatch.setattr(ipopt.time, "perf_counter", lambda: float(next(seconds)))


def test_the_time_limit_is_that_of_all_starts_and_grids(reference_problem, clock):
    gait, iterations = count_iterations(reference_problem(sequence=SLIP), starts=20, solver=Ipopt(time_limit=250))
    assert gait.status is Status.TIME_LIMIT
    assert iterations < 260
    # The best result before the limit: all starts are solved on the coarsest grid first.
    assert "the result is the solution before this refinement" in gait.solver.message
    assert gait.problem["intervals"] == [5, 10]
    assert gait.solver.constraint_violation <= 1e-6
    gait, iterations = count_iterations(reference_problem(sequence=SLIP), starts=20, solver=Ipopt(time_limit=20))
    assert gait.status is Status.TIME_LIMIT
    assert iterations < 25


def test_a_sequence_of_three_phases_is_concluded(reference_problem):
    """Its elastic problems take up to 104 iterations from two of three starts; it ended at the iteration limit."""
    problem = reference_problem(sequence="slip+ stick slip- | stick", friction=0.3, intervals=16, **SMOOTH)
    gait, iterations = count_iterations(problem)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.conflicts
    assert iterations < 600
