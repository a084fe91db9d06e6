"""Sequential quadratic programming: closed forms, repeated solves of the cost of transport, and its fallback."""

import os
import signal

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Ipopt, Limits, Newton, Status, WarmStart, compass_biped, solve
from gaitopt.ocp.nlp import sqp
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.progress import silent
from tests.ocp.test_active_set import small_nlp

STICK, SLIP = "stick | stick", "slip+ stick | slip+"


def problem(sequence=STICK, intervals=20, torque=6.0, **changes):
    fields = {"friction": 0.14, "speed": 0.633, "step_length": 0.4713, **changes}
    limits, grid = Limits(torque=torque), Collocation(intervals=intervals)
    return GaitProblem(robot=compass_biped(), sequence=sequence, limits=limits, transcription=grid, **fields)


@pytest.fixture(scope="module")
def gaits():
    return {sequence: solve(problem(sequence)) for sequence in (STICK, SLIP)}


@pytest.fixture
def without_ipopt(monkeypatch):
    monkeypatch.setattr(Ipopt, "minimise", lambda *given: pytest.fail("Ipopt was called"))


@pytest.fixture
def runs(monkeypatch):
    """Return the results of all runs, None for those that do not converge."""
    results, run = [], sqp.minimise_from_solution

    def minimise(*arguments):
        results.append(run(*arguments))
        return results[-1]

    monkeypatch.setattr(sqp, "minimise_from_solution", minimise)
    return results


def minimised(start, multipliers, update=None, *, upper=10.0, least=-10.0, observer=silent, **options):
    """Return the result for: minimise |y^2 - 2| + y / 10 subject to least <= y <= upper, with x >= |...|."""

    def above(x, z):
        return [x[0] + x[1] ** 2 - z, x[0] - x[1] ** 2 + z]

    nlp = small_nlp(lambda x, z: x[0] + 0.1 * x[1], above, typical=0.1, smooth=False)
    bounds = Bounds(np.array([-10.0, least]), np.array([10.0, upper]), np.zeros(2), np.full(2, np.inf))
    start, given = np.array(start, float), (np.zeros(2), np.array(multipliers, float))
    return sqp.minimise_from_solution(nlp, start, np.array([2.0]), bounds, observer, given, Ipopt(**options), update)


def test_a_minimum_at_a_kink():
    """Minimise |y^2 - 2| + y / 10 near its kink y = sqrt(2); stationarity 0.1 + 2 y (m2 - m1) = 0, m1 + m2 = -1."""
    found = minimised([0.2, 1.3], [-0.5, -0.5])
    y = np.sqrt(2)
    np.testing.assert_allclose(found.x, [0, y], atol=1e-8)
    np.testing.assert_allclose(found.multipliers[1], [-0.5 - 0.025 / y, -0.5 + 0.025 / y], atol=1e-6)
    np.testing.assert_allclose(found.multipliers[0], 0, atol=1e-6)
    assert found.objective == pytest.approx(0.1 * y, rel=1e-7)
    assert found.status is Status.SOLVED
    assert found.iterations <= 6


def test_an_active_bound_has_its_multiplier():
    """With y <= 1 the first kink is not reached: |y^2 - 2| = 2 - y^2, and the slope 0.1 - 2 y is that of the bound."""
    found = minimised([0.9, 0.9], [0, -1], upper=1.0)
    np.testing.assert_allclose(found.x, [1, 1], atol=1e-8)
    np.testing.assert_allclose(found.multipliers[0], [0, 1.9], atol=1e-6)


def test_a_fixed_unknown():
    found = minimised([0.9, 0.9], [0, -1], upper=1.0, least=1.0)
    assert found.x[1] == 1  # exactly
    np.testing.assert_allclose(found.x, [1, 1], atol=1e-8)
    np.testing.assert_allclose(found.multipliers[0], [0, 1.9], atol=1e-6)


def test_a_start_with_a_multiplier_of_an_inactive_bound_is_no_solution():
    """All conditions but complementarity are satisfied at x = y = 1 if y <= 1 is no longer a bound."""
    found = minimised([1.0, 1.0], [0, -1], upper=10.0)
    np.testing.assert_allclose(found.x, [0, np.sqrt(2)], atol=1e-8)


def test_data_are_updated_after_large_steps_only():
    points = []
    found = minimised([0.2, 1.3], [-0.5, -0.5], lambda x: points.append(x) or np.array([2.0]))
    assert 0 < len(points) < found.iterations
    assert found.data.tolist() == [2.0]
    assert np.abs(points[-1] - found.x).max() < 1e-2


def test_no_more_steps_than_iterations_are_allowed():
    assert minimised([0.2, 1.3], [-0.5, -0.5], max_iterations=1) is None


@pytest.mark.parametrize("number", [0, 2])
@pytest.mark.parametrize("how", ["raised", "signalled"])
def test_an_interrupt_keeps_the_iterate(number, how):
    def observe(iteration):
        if iteration.number == number:
            if how == "raised":
                raise KeyboardInterrupt
            os.kill(os.getpid(), signal.SIGINT)

    found = minimised([0.2, 1.3], [-0.5, -0.5], observer=observe)
    assert found.status is Status.INTERRUPTED
    assert found.iterations == number
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_qp_without_a_solution_has_no_result():
    nlp = small_nlp(lambda x, z: x[0], lambda x, z: [x[0] + x[1], x[0] + x[1]], smooth=False)
    bounds = Bounds(np.zeros(2), np.ones(2), np.array([0.0, 1.0]), np.array([0.5, 2.0]))
    none = np.zeros(2), np.zeros(2)
    assert sqp.minimise_from_solution(nlp, np.zeros(2), np.zeros(1), bounds, silent, none, Ipopt()) is None


@pytest.mark.parametrize("sequence", [STICK, SLIP])
@pytest.mark.parametrize("changes", [{"friction": 0.15}, {"speed": 0.62}, {"torque": 6.5}])
def test_gaits_of_nearby_problems_need_no_interior_point_method(sequence, changes, gaits, without_ipopt, monkeypatch):
    warm = solve(problem(sequence, guess=WarmStart(gaits[sequence]), **changes))
    monkeypatch.undo()
    cold = solve(problem(sequence, **changes))
    assert warm.status is cold.status is Status.SOLVED
    assert warm.solver.message == cold.solver.message
    assert warm.solver.objective <= cold.solver.objective * (1 + 1e-6)
    assert warm.solver.constraint_violation <= 1e-8
    assert warm.solver.iterations <= 12


def test_the_work_is_exact_after_one_solve(gaits, runs):
    """Sign changes of the powers are located after each step, so that no second solve is needed."""
    gait = solve(problem(STICK, friction=0.15, guess=WarmStart(gaits[STICK])))
    assert len(runs) == 1
    assert runs[0].objective == pytest.approx(gait.solver.objective, rel=2e-5)


def test_the_certificate_is_that_of_a_cold_solve(gaits):
    warm = solve(problem(STICK, friction=0.15, guess=WarmStart(gaits[STICK])))
    cold = solve(problem(STICK, friction=0.15))
    assert warm.certificate.verdict == cold.certificate.verdict
    slopes = [gait.certificate.derivative_of("friction") for gait in (warm, cold)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)


def test_without_convergence_the_interior_point_method_solves(gaits, runs, monkeypatch):
    monkeypatch.setattr(sqp, "MOST_STEPS", 1)
    warm = solve(problem(STICK, friction=0.15, guess=WarmStart(gaits[STICK])))
    assert runs
    assert runs[0] is None
    assert warm.status is Status.SOLVED
    assert warm.solver.objective == pytest.approx(solve(problem(STICK, friction=0.15)).solver.objective, rel=1e-5)


def test_the_time_limit_ends_the_steps(gaits, runs):
    warm = solve(problem(STICK, friction=0.15, guess=WarmStart(gaits[STICK])), solver=Ipopt(time_limit=1e-9))
    assert warm.status is Status.TIME_LIMIT
    late = Newton(fallback=Ipopt(time_limit=1e-9))
    assert solve(problem(STICK, friction=0.15, guess=WarmStart(gaits[STICK])), solver=late).status is Status.TIME_LIMIT
    assert runs == [None]


@pytest.mark.parametrize(("worse", "expected"), [(np.inf, [1, 2, 3]), (-np.inf, [1, 1 / 4, 1 / 16, 1 / 64])])
def test_the_box_shrinks_after_steps_that_increase_the_merit_function(worse, expected, monkeypatch):
    boxes, take = [], sqp._Steps.take

    def record(self, iterate, weight, box):
        boxes.append(box)
        return take(self, iterate, weight, box)

    monkeypatch.setattr(sqp._Steps, "take", record)
    monkeypatch.setattr(sqp, "MOST_WORSE", worse)
    found = minimised([0.2, 1.3], [-0.5, -0.5])
    assert (found is None) == (worse < 0)
    assert boxes == expected


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_another_number_of_intervals_is_solved_by_the_interior_point_method(sequence, gaits, runs):
    gait = solve(problem(sequence, intervals=16, guess=WarmStart(gaits[sequence])))
    assert gait.status is Status.SOLVED
    assert all(run is None or run.iterations <= sqp.MOST_STEPS for run in runs)
