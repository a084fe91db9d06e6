"""Newton's method against closed forms, against Ipopt, and where it must give way."""

import math
import os
import signal
import sys
import threading

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, InputError, Ipopt, Limits, Newton, Status, WarmStart, solve, verify
from gaitopt.ocp.nlp import active_set
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.factorisation_warnings import discard_warnings
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.progress import silent


@pytest.fixture
def newton_runs(monkeypatch):
    """Return the results of all runs of Newton's method, None for those that do not converge."""
    results, minimise = [], active_set._Run.minimise

    def run(self, *arguments):
        results.append(minimise(self, *arguments))
        return results[-1]

    monkeypatch.setattr(active_set._Run, "minimise", run)
    return results


def small_nlp(cost, constraints, *, typical=1.0, smooth=True):
    """Return the NLP of two unknowns and one number given."""
    x, z = ca.SX.sym("x", 2), ca.SX.sym("z")
    values = ca.vertcat(ca.SX(0, 1), *constraints(x, z))
    rows = np.arange(values.numel())[:, None]
    block = Block(name="all", variables=x, cost=cost(x, z), constraints=values, columns=np.array([[0], [1]]), rows=rows)
    return assemble_nlp([block], z, 2, values.numel(), typical=typical, smooth=smooth)


def minimised(nlp, start, data, x_bounds, g_bounds, solver=None, observer=silent):
    (x_lower, x_upper), (g_lower, g_upper) = np.array(x_bounds, float).T, np.array(g_bounds, float).T
    bounds = Bounds(x_lower, x_upper, g_lower, g_upper)
    return (solver or Newton()).minimise(nlp, np.array(start, float), np.array([data], float), bounds, observer)


FREE = [(-math.inf, math.inf)] * 2


@pytest.mark.parametrize("typical", [1.0, 1e-3, 1e3])
def test_an_equality(typical):
    """The point of the line x + y = z nearest to the origin, weighted: a quadratic program takes one step."""
    nlp = small_nlp(lambda x, z: x[0] ** 2 + 2 * x[1] ** 2, lambda x, z: [x[0] + x[1]], typical=typical)
    found = minimised(nlp, [5, -3], 0.0, FREE, [(3, 3)])
    np.testing.assert_allclose(found.x, [2, 1], rtol=1e-10)
    np.testing.assert_allclose(found.multipliers[1], [-4], rtol=1e-10)  # minus the slope of the minimum 2/3 c^2 at 3
    assert found.status is Status.SOLVED
    assert found.iterations <= 2
    assert found.objective == pytest.approx(6, rel=1e-10)


@pytest.mark.parametrize(
    ("x_bounds", "g_bounds", "x", "on_bounds", "on_rows"),
    [
        ([(-9, 9), (-9, 1)], [(-9, 9)], [3, 1], [0, 2], [0]),  # presses against y <= 1
        ([(4, 9), (-9, 9)], [(-9, 9)], [4, 2], [-2, 0], [0]),  # against x >= 4
        ([(-9, 9), (-9, 9)], [(-9, 3)], [2, 1], [0, 0], [2]),  # against x + y <= 3
        ([(-9, 9), (-9, 9)], [(7, 9)], [4, 3], [0, 0], [-2]),  # against x + y >= 7
        ([(0, 0), (-9, 9)], [(7, 9)], [0, 7], [16, 0], [-10]),  # x is given, and x + y >= 7
        ([(-9, 9), (-9, 9)], [(-9, 9)], [3, 2], [0, 0], [0]),  # against nothing
    ],
)
@pytest.mark.parametrize("start", [(0, 0), (8, -8)])
def test_inequalities_exactly_with_their_multipliers(x_bounds, g_bounds, x, on_bounds, on_rows, start, newton_runs):
    """The point of a polygon nearest to (3, 2): stationarity  2 (x - c) + multipliers = 0  by hand."""
    nlp = small_nlp(lambda x, z: ca.sumsqr(x - ca.vertcat(3, 2)), lambda x, z: [x[0] + x[1]])
    found = minimised(nlp, start, 0.0, x_bounds, g_bounds)
    assert newton_runs[-1] is not None
    np.testing.assert_allclose(found.x, x, atol=1e-9)
    np.testing.assert_allclose(found.multipliers[0], on_bounds, atol=1e-8)
    np.testing.assert_allclose(found.multipliers[1], on_rows, atol=1e-8)


def test_constraints_that_repeat_each_other(newton_runs):
    nlp = small_nlp(lambda x, z: ca.sumsqr(x), lambda x, z: [x[0] + x[1], 2 * x[0] + 2 * x[1]])
    found = minimised(nlp, [5, -3], 0.0, FREE, [(2, 2), (4, 4)])
    assert newton_runs[-1] is not None
    np.testing.assert_allclose(found.x, [1, 1], atol=1e-8)


def test_a_saddle_is_no_answer():
    """Newton's method walks straight to the saddle of x^2 - y^2; the minimum lies on a bound."""
    nlp = small_nlp(lambda x, z: x[0] ** 2 - x[1] ** 2, lambda x, z: [x[0]])
    found = minimised(nlp, [0.5, 0.1], 0.0, [(-1, 1), (-1, 1)], [(-9, 9)])
    np.testing.assert_allclose(np.abs(found.x), [0, 1], atol=1e-6)
    assert found.objective == pytest.approx(-1, abs=1e-6)


def test_a_start_from_which_it_diverges_is_left_to_the_other_solver(newton_runs):
    """Newton's method for the root of arctan diverges from beyond 1.39."""
    nlp = small_nlp(lambda x, z: x[0] * ca.atan(x[0]) - ca.log(1 + x[0] ** 2) / 2 + x[1] ** 2, lambda x, z: [x[1]])
    minimised(nlp, [1.0, 0], 0.0, FREE, [(-9, 9)])
    assert len(newton_runs) == 1
    assert newton_runs[0] is not None
    alone = minimised(nlp, [3.0, 0], 0.0, FREE, [(-9, 9)], Ipopt())
    seen = []
    found = minimised(nlp, [3.0, 0], 0.0, FREE, [(-9, 9)], observer=lambda step: seen.append(step.number))
    assert seen[:4] == [0, 1, 2, 0]  # the error has not fallen in the second step, so Ipopt begins
    assert found.iterations >= alone.iterations > 2
    np.testing.assert_allclose(found.x, [0, 0], atol=1e-8)


@pytest.mark.parametrize("start", [-1e-9, -5.0, 0.1 - 1e-9])
def test_a_start_outside_of_a_bound_does_not_stay_at_it(start):
    """The least of (x - 3)^2 is within the bounds; a variable just outside of one does not stay there."""
    nlp = small_nlp(lambda x, z: (x[0] - 3) ** 2 + x[1] ** 2, lambda x, z: [x[1]])
    for low in (0.0, 0.1):
        found = minimised(nlp, [start, 0], 0.0, [(low, 9), (-9, 9)], [(-9, 9)])
        np.testing.assert_allclose(found.x, [3, 0], atol=1e-8)
        np.testing.assert_allclose(found.multipliers[0], 0, atol=1e-7)


def test_what_is_outside_counts_whatever_the_multipliers_begin_with():
    """At the free minimum a multiplier of the wrong sign takes the violated constraint for an inactive one."""
    nlp = small_nlp(lambda x, z: ca.sumsqr(x - ca.vertcat(3, 2)), lambda x, z: [x[0] + x[1]])
    bounds = Bounds(*(np.array(limit) for limit in ([-99.0, -99.0], [99.0, 99.0], [-math.inf], [1.0])))
    wrong = (np.zeros(2), np.array([-10.0]))
    found = Newton().minimise(nlp, np.array([3.0, 2.0]), np.zeros(1), bounds, silent, wrong)
    np.testing.assert_allclose(found.x, [1, 0], atol=1e-8)


def test_multipliers_of_what_is_not_active_are_zero():
    """Where both unknowns are given there is nothing to do, but not at the price the multipliers begin with."""
    nlp = small_nlp(lambda x, z: ca.sumsqr(x), lambda x, z: [x[0] + x[1]])
    bounds = Bounds(*(np.array(limit) for limit in ([1.0, 2.0], [1.0, 2.0], [-9.0], [9.0])))
    found = Newton().minimise(nlp, np.array([1.0, 2.0]), np.zeros(1), bounds, silent, (np.zeros(2), np.array([0.5])))
    np.testing.assert_allclose(found.multipliers[0], [-2, -4], atol=1e-12)
    assert found.multipliers[1] == 0


def test_what_is_not_a_number_is_no_solution():
    nlp = small_nlp(lambda x, z: ca.sqrt(x[0]) + x[1] ** 2, lambda x, z: [x[1]])
    assert minimised(nlp, [-1, 0], 0.0, FREE, [(-9, 9)]).status is Status.INVALID_NUMBER


def test_an_nlp_without_constraints():
    nlp = small_nlp(lambda x, z: ca.sumsqr(x - 1), lambda x, z: [])
    np.testing.assert_allclose(minimised(nlp, [5, -3], 0.0, FREE, np.zeros((0, 2))).x, [1, 1], atol=1e-9)


def test_an_interrupt_at_the_last_step_is_not_lost():
    nlp = small_nlp(lambda x, z: ca.sumsqr(x), lambda x, z: [x[0]])
    bounds = Bounds(*(np.array(limit) for limit in ([-1.0, -1.0], [1.0, 1.0], [-9.0], [9.0])))

    def observe(iteration):
        raise KeyboardInterrupt

    found = Newton().minimise(nlp, np.zeros(2), np.zeros(1), bounds, observe)
    assert found.status is Status.INTERRUPTED


@pytest.mark.parametrize(("size", "by_newton"), [(100, True), (300, False)])
def test_a_constraint_of_very_many_unknowns_is_left_to_the_other_solver(size, by_newton, newton_runs):
    x, index = ca.SX.sym("x", size), np.arange(size)[:, None]
    block = Block(
        name="all", variables=x, cost=ca.sumsqr(x), constraints=ca.sum1(x), columns=index, rows=np.zeros((1, 1), int)
    )
    nlp = assemble_nlp([block], ca.SX.sym("z"), size, 1, smooth=True)
    found = minimised(nlp, np.zeros(size), 0.0, [(-9, 9)] * size, [(size, size)])
    assert bool(newton_runs) is by_newton
    np.testing.assert_allclose(found.x, 1, atol=1e-8)


def test_a_constraint_may_need_more_steps_than_the_gradient(newton_runs):
    """Without an objective, as for a walker that needs no torque, the gradient is right from the start."""
    nlp = small_nlp(lambda x, z: 0 * x[0] + x[1] ** 2, lambda x, z: [ca.exp(x[0])])
    found = minimised(nlp, [1.0, 0], 0.0, FREE, [(9, 9)])
    assert newton_runs[-1] is not None
    np.testing.assert_allclose(found.x, [math.log(9), 0], atol=1e-9)


def test_an_infeasible_nlp_is_reported_by_the_other_solver():
    nlp = small_nlp(lambda x, z: ca.sumsqr(x), lambda x, z: [x[0] + x[1]])
    assert minimised(nlp, [0, 0], 0.0, [(0, 1), (0, 1)], [(3, 3)]).status is Status.INFEASIBLE


@pytest.fixture(scope="module")
def squared(reference_problem):
    return reference_problem(objective="torque_squared", friction=0.2, intervals=20)


@pytest.mark.parametrize("changes", [{}, {"friction": 0.14}, {"sequence": "slip+ stick | slip+"}, {"torque": 4.5}])
def test_gaits_are_those_of_the_interior_point(reference_problem, changes, newton_runs):
    """Ipopt leaves its bounds by 1e-8, which multipliers turn into a slightly lower cost: never a higher one."""
    problem = reference_problem(**{"objective": "torque_squared", "friction": 0.2, "intervals": 20, **changes})
    gait, other = solve(problem), solve(problem, solver=Ipopt())
    assert gait.solver.objective == pytest.approx(other.solver.objective, rel=1e-5)
    assert gait.solver.objective >= other.solver.objective * (1 - 1e-9)
    assert newton_runs[-1] is not None
    assert gait.solver.message == other.solver.message
    assert verify(gait).verification.passed


def test_going_on_at_another_speed_needs_few_steps_and_no_other_solver(squared, monkeypatch):
    gait = solve(squared)
    cold = solve(squared.replace(speed=0.66), solver=Ipopt())
    monkeypatch.setattr(Ipopt, "minimise", None)
    warm = solve(squared.replace(speed=0.66, guess=WarmStart(gait)))
    assert warm.solver.iterations <= 6
    assert warm.solver.objective == pytest.approx(cold.solver.objective, rel=1e-6)
    assert verify(warm).verification.passed


def test_multipliers_are_the_slope_of_the_optimum(squared):
    """The multiplier of the speed is minus the derivative of the least cost with respect to it."""
    exact = squared.replace(transcription=Collocation(intervals=20, tolerance=math.inf))
    gait = solve(exact)
    ahead, behind = (solve(exact.replace(speed=0.633 + step, guess=WarmStart(gait))) for step in (1e-5, -1e-5))
    slope = (ahead.solver.objective - behind.solver.objective) / 2e-5
    table = gait.solution.constraints["touchdown"]
    assert -float(table.multipliers[table.rows.index("speed"), 0]) == pytest.approx(slope, rel=1e-6)


def test_an_objective_with_kinks_is_not_for_newton(reference_problem, newton_runs):
    assert solve(reference_problem(intervals=10)).status is Status.SOLVED
    assert not newton_runs


@pytest.mark.parametrize("how", ["raised", "signalled"])
def test_an_interrupt_keeps_the_iterate(squared, how):
    def observe(iteration):
        if iteration.number == 2:
            if how == "raised":
                raise KeyboardInterrupt
            os.kill(os.getpid(), signal.SIGINT)

    gait = solve(squared, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.iterations == 2
    assert gait.motion.period > 0
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_no_more_steps_than_iterations_are_allowed(squared):
    gait = solve(squared, solver=Newton(fallback=Ipopt(max_iterations=2)))
    assert gait.status is Status.ITERATION_LIMIT


def test_limits_that_are_held_are_met_exactly(reference_problem, newton_runs):
    problem = reference_problem(objective="torque_squared", friction=0.2, intervals=20)
    free = solve(problem.replace(limits=Limits(torque=math.inf)))
    largest = np.abs(free.solution.unknowns["torque"].values).max()
    held = solve(problem.replace(limits=Limits(torque=0.97 * largest), guess=WarmStart(free)))
    assert newton_runs[-1] is not None
    assert np.abs(held.solution.unknowns["torque"].values).max() == pytest.approx(0.97 * largest, rel=1e-9)
    assert held.solver.objective > free.solver.objective


def test_solvers_that_are_none_are_refused(squared):
    with pytest.raises(InputError, match=r"Newton.fallback must be an Ipopt"):
        Newton(fallback=Ipopt)
    for given in (3, Ipopt, "ipopt"):
        with pytest.raises(InputError, match=r"solver must be a Newton\(...\) or an Ipopt"):
            solve(squared, solver=given)


def test_a_large_nlp_is_left_to_the_other_solver_unless_the_grid_is_known(squared, newton_runs, monkeypatch):
    """Newton's method is tried from a gait on the same grid alone, and the result of the fallback is kept."""
    monkeypatch.setattr(active_set, "LARGE", 100)
    gait = solve(squared)
    assert gait.status is Status.SOLVED
    assert not newton_runs
    assert solve(squared.replace(speed=0.64, guess=WarmStart(gait))).status is Status.SOLVED
    assert newton_runs[-1] is not None


def test_a_vanishing_pivot_gives_no_output(capfd):
    """Two equal constraints of large slope: the compliance of the second is lost by cancellation."""
    nlp = small_nlp(lambda x, z: x[0] ** 2 + x[1] ** 2, lambda x, z: [1e6 * (x[0] + x[1])] * 2)
    found = minimised(nlp, [5, -3], 0.0, FREE, [(3, 3)] * 2)
    np.testing.assert_allclose(found.x, [1.5e-6, 1.5e-6], rtol=1e-6)
    assert capfd.readouterr() == ("", "")


def test_warnings_of_other_threads_are_written(capsys):
    stream = sys.stderr
    with discard_warnings():
        print("of this thread", file=sys.stderr)
        other = threading.Thread(target=print, args=["of another thread"], kwargs={"file": sys.stderr})
        other.start()
        other.join()
    print("after the block", file=sys.stderr)
    assert sys.stderr is stream
    assert capsys.readouterr().err == "of another thread\nafter the block\n"
