"""The integrator and the root search of the reference engine, compared with those of SciPy."""

import numpy as np
import pytest
from scipy.integrate import DOP853
from scipy.optimize import brentq

from gaitopt.simulation import dormand_prince
from gaitopt.simulation.dormand_prince import DormandPrince
from gaitopt.simulation.event_location import find_root

TOLERANCES = {"relative": 1e-12, "absolute": 1e-14}


def pendulum(t, y):
    return np.array([y[1], -9.81 * np.sin(y[0]) - 0.1 * y[1] + np.cos(3 * t)])


def kepler(t, y):
    return np.concatenate([y[2:], -y[:2] / np.hypot(*y[:2]) ** 3])


def stiff(t, y):
    return np.array([-80 * (y[0] - np.cos(t)), y[0] * y[1]])


PROBLEMS = {
    "pendulum": (pendulum, [1.2, 0.3], 2.0),
    "kepler": (kepler, [0.4, 0, 0, 2.0], 3.0),
    "stiff": (stiff, [0.0, 1.0], 1.5),
    "rest": (lambda t, y: 0 * y, [0.0, 0.0], 1.0),
}


def take_steps(integrator):
    """Return the times and the states at the nodes and inside the steps."""
    rows = []
    while integrator.status == "running":
        integrator.step()
        dense = integrator.dense_output()
        inside = (dense.t_old + fraction * (dense.t - dense.t_old) for fraction in (0.1, 0.5, 0.93))
        rows.append([integrator.t, *integrator.y, *(value for t in inside for value in dense(t))])
    assert integrator.status == "finished"
    return np.array(rows)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("first_step", [None, 0.5])
def test_the_steps_are_those_of_scipy(name, first_step):
    rate, y, end = PROBLEMS[name]
    steps = take_steps(DormandPrince(rate, 0.0, np.array(y), end, first_step=first_step, **TOLERANCES))
    reference = take_steps(DOP853(rate, 0.0, np.array(y), end, rtol=1e-12, atol=1e-14, first_step=first_step))
    assert steps.shape == reference.shape
    np.testing.assert_allclose(steps, reference, rtol=1e-14, atol=1e-15)


def test_states_at_several_times_are_those_of_single_calls():
    integrator = DormandPrince(pendulum, 0.0, np.array([1.2, 0.3]), 2.0, **TOLERANCES)
    integrator.step()
    dense = integrator.dense_output()
    times = np.linspace(dense.t_old, dense.t, 7)
    np.testing.assert_array_equal(dense.at_times(times), [dense(t) for t in times])


def test_the_coefficients_are_those_of_scipy():
    for name, attribute in (("A_DENSE", "A_EXTRA"), ("C_DENSE", "C_EXTRA"), ("E3", "E3"), ("E5", "E5"), ("D", "D")):
        np.testing.assert_array_equal(getattr(dormand_prince, name), getattr(DOP853, attribute))


def test_an_integration_fails_where_the_solution_ends():
    integrator = DormandPrince(lambda t, y: y**2, 0.0, np.array([1.0]), 2.0, **TOLERANCES)  # y = 1 / (1 - t)
    with np.errstate(all="ignore"):
        while integrator.status == "running":
            integrator.step()
    assert integrator.status == "failed"
    assert abs(integrator.t - 1) < 1e-6


@pytest.mark.parametrize("rate", [np.nan, np.inf, 1e300])
def test_an_integration_fails_if_the_rate_is_not_finite_or_too_large(rate):
    with np.errstate(all="ignore"):
        integrator = DormandPrince(lambda t, y: np.full(2, rate), 0.0, np.ones(2), 1.0, **TOLERANCES)
        for _ in range(50):
            if integrator.status == "running":
                integrator.step()
    assert integrator.status == "failed"


def test_no_step_is_taken_over_an_empty_interval():
    integrator = DormandPrince(pendulum, 1.0, np.ones(2), 1.0, **TOLERANCES)
    integrator.step()
    assert integrator.status == "finished"
    assert integrator.t == 1.0


ROOTS = {
    "line": lambda t: 0.3 - t,
    "cosine": lambda t: np.cos(3 * t) - 0.2,
    "steep": lambda t: np.exp(-50 * t) - 1e-3,
    "jump": lambda t: 1.0 if t < 0.7 else -1e-8,
}


@pytest.mark.parametrize("name", ROOTS)
@pytest.mark.parametrize("span", [(0.0, 1.0), (0.1, 0.95), (-0.2, 0.8)])
def test_roots_are_those_of_scipy(name, span):
    guard = ROOTS[name]
    assert find_root(guard, span) == brentq(guard, *span, xtol=1e-15, rtol=1e-15)


def test_roots_at_an_end_and_without_a_sign_change():
    assert find_root(lambda t: -t, (0.0, 1.0)) == 0.0
    assert find_root(lambda t: 1 - t, (0.0, 1.0)) == 1.0
    assert find_root(lambda t: 2 - t, (0.0, 1.0)) == 1.0


def test_a_root_of_high_order_is_found():
    """SciPy gives up after 100 iterations."""
    assert find_root(lambda t: (0.4 - t) ** 5, (0.0, 1.0)) == pytest.approx(0.4, abs=1e-12)
