import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import CostOfTransport, InputError, Objective, PositiveWork, TorqueSquared
from gaitopt.ocp.objective import KINKED, OBJECTIVES, SMOOTH, objective_named

REAL = st.floats(-10, 10)


def value(objective, torque, power):
    positive, negative = np.maximum(power, 0), np.maximum(-power, 0)
    return float(ca.DM(objective.integrand(*map(ca.SX, (torque, positive, negative)))))


@given(st.tuples(REAL, REAL), st.tuples(REAL, REAL))
def test_integrands_of_known_powers(torque, power):
    torque, power = np.array(torque), np.array(power)
    assert value(CostOfTransport(), torque, power) == pytest.approx(np.sum(np.abs(power)))
    assert value(PositiveWork(), torque, power) == pytest.approx(np.sum(np.maximum(power, 0)))
    assert value(TorqueSquared(), torque, power) == pytest.approx(np.sum(torque**2))


@given(REAL, REAL)
def test_the_smooth_rule_is_exact_for_the_square_of_a_linear_torque(left, right):
    exact = (left**2 + left * right + right**2) / 3
    assert np.dot(SMOOTH, [left**2, ((left + right) / 2) ** 2, right**2]) == pytest.approx(exact, abs=1e-12)


@given(REAL, REAL)
def test_the_kinked_rule_never_undervalues_the_absolute_of_a_linear_power(left, right):
    exact = (abs(left) + abs(right)) / 2
    if left * right < 0:
        exact = (left**2 + right**2) / (2 * (abs(left) + abs(right)))
    rule = np.dot(KINKED, np.abs([left, (left + right) / 2, right]))
    assert rule >= exact - 1e-12


def test_simpson_would_undervalue_a_kink():
    # |t| on [-1, 3]: the integral is 5, Simpson gives 14/3, the kinked rule 6 (by hand).
    samples = [1.0, 1.0, 3.0]
    assert 4 * np.dot(SMOOTH, samples) == pytest.approx(16 / 3)
    samples = [1.0, 0.0, 1.0]  # |t| on [-1, 1]: the integral is 1
    assert 2 * np.dot(SMOOTH, samples) < 1 <= 2 * np.dot(KINKED, samples)


@pytest.mark.parametrize("name", ["cost_of_transport", "torque_squared", "positive_work"])
def test_every_objective_is_known_by_its_name(name):
    assert objective_named(name).name == name
    assert type(objective_named(name)) is OBJECTIVES[name]


def test_an_objective_stands_for_itself():
    objective = TorqueSquared()
    assert objective_named(objective) is objective


def test_equal_objectives_share_a_transcription():
    assert TorqueSquared() == TorqueSquared()
    assert hash(TorqueSquared()) == hash(TorqueSquared())


@pytest.mark.parametrize("name", ["torque_sqared", 3, None])
def test_an_unknown_objective_lists_the_known_ones(name):
    with pytest.raises(InputError, match=r"no objective .*Known: cost_of_transport, torque_squared, positive_work"):
        objective_named(name)


def test_an_objective_needs_an_integrand():
    with pytest.raises(TypeError, match="abstract"):
        Objective()
