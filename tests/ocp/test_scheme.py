"""Quadrature and integration of the schemes against closed forms and scipy."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import root

from gaitopt import Mode, compass_biped
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.ocp.transcription.collocation import Lobatto, integrals, lobatto_points
from gaitopt.ocp.transcription.shooting import RungeKutta

REAL = st.floats(-10, 10)
SCHEMES = [RungeKutta(), Lobatto(3), Lobatto(4), Lobatto(5)]
every_scheme = pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
ROBOT = compass_biped()
P = ROBOT.vector(ROBOT.resolve({"friction": 0.14}))
STATES = {
    Mode.STICK: [-0.12, -0.14, 0.75, -0.5],
    Mode.SLIP_FORWARD: [-0.12, -0.14, 0.75, -0.5, 0.01, 0.3],
    Mode.SLIP_BACKWARD: [0.1, 0.12, 0.7, 0.2, -0.02, -0.4],
}
TORQUE, RISE = np.array([1.0, -2.0]), np.array([-40.0, 60.0])


def points(scheme):
    return np.array([0.0, *scheme.inner, 1.0])


def test_lobatto_points_and_weights():
    # Abramowitz & Stegun, table 25.6: +-0.44721360 with weights 5/6 and 1/6 on [-1, 1]; five points +-sqrt(3/7), 0.
    assert 2 * lobatto_points(4) - 1 == pytest.approx([-1, -(5**-0.5), 5**-0.5, 1])
    assert Lobatto(4).smooth_weights() == pytest.approx([1 / 12, 5 / 12, 5 / 12, 1 / 12])
    assert 2 * lobatto_points(5) - 1 == pytest.approx([-1, -((3 / 7) ** 0.5), 0, (3 / 7) ** 0.5, 1])
    assert Lobatto(3).smooth_weights() == pytest.approx([1 / 6, 4 / 6, 1 / 6])
    assert RungeKutta().smooth_weights() == pytest.approx([1 / 6, 4 / 6, 1 / 6])


@pytest.mark.parametrize("count", [3, 4, 5])
def test_integrals_of_powers_are_exact(count):
    at, (once, twice) = lobatto_points(count), integrals(count)
    for power in range(count):
        assert once @ at**power == pytest.approx(at ** (power + 1) / (power + 1), abs=1e-14)
        assert twice @ at**power == pytest.approx(at ** (power + 2) / ((power + 1) * (power + 2)), abs=1e-14)


@every_scheme
@given(REAL, REAL)
def test_the_smooth_rule_is_exact_for_the_square_of_a_linear_torque(scheme, left, right):
    samples = (left + (right - left) * points(scheme)) ** 2
    exact = (left**2 + left * right + right**2) / 3
    assert np.dot(scheme.smooth_weights(), samples) == pytest.approx(exact, abs=1e-10)


@every_scheme
@given(REAL, REAL)
def test_the_kinked_rule_never_undervalues_the_absolute_of_a_linear_power(scheme, left, right):
    exact = (abs(left) + abs(right)) / 2
    if left * right < 0:
        exact = (left**2 + right**2) / (2 * (abs(left) + abs(right)))
    rule = np.dot(scheme.kinked_weights(), np.abs(left + (right - left) * points(scheme)))
    assert rule >= exact - 1e-12
    assert rule <= exact + 0.5 * (abs(left) + abs(right)) * max(np.diff(points(scheme))) + 1e-12


def test_a_smooth_rule_would_undervalue_a_kink():
    # |t| on [-1, 1]: the integral is 1, Simpson gives 2/3, the trapezoids 1.
    samples = [1.0, 0.0, 1.0]
    assert 2 * np.dot(RungeKutta().smooth_weights(), samples) < 1 <= 2 * np.dot(RungeKutta().kinked_weights(), samples)


@pytest.mark.parametrize("mode", STATES)
def test_the_balance_vanishes_at_the_forward_dynamics_with_the_same_force(mode):
    """Two ways to the same physics: equations solved for the acceleration, and the residual of a given one."""
    stance = PhaseDynamics(ROBOT, mode)
    state, torque, p = ca.SX.sym("x", stance.n_x), ca.SX.sym("u", 2), ca.SX.sym("p", len(P))
    forward = RungeKutta().node(stance, state, torque, ca.SX(0, 1), p)
    residual, force = stance.balance(state, forward.acceleration, torque, p)
    both = ca.Function("both", [state, torque, p], [residual, force, forward.force])(STATES[mode], TORQUE, P)
    assert np.asarray(both[0]).ravel() == pytest.approx(np.zeros(stance.n_a), abs=1e-14)
    assert np.asarray(both[1]).ravel() == pytest.approx(np.asarray(both[2]).ravel(), abs=1e-11)


@pytest.mark.parametrize("mode", STATES)
@every_scheme
def test_one_interval_converges_to_scipy_with_the_order_of_the_scheme(scheme, mode):
    order = 4 if isinstance(scheme, RungeKutta) else 2 * scheme.points - 2
    errors = [abs(advanced(scheme, mode, step) - reference(mode, step)).max() for step in (0.1, 0.05, 0.025)]
    # One step of order k has an error of order k + 1; at order 8 rounding shows.
    assert errors[2] < errors[0] / 4 ** (order - 0.5) or errors[2] < 1e-11


def advanced(scheme, mode, step):
    """Return the state after one interval, solving the scheme's own equations for its unknowns."""
    stance = PhaseDynamics(ROBOT, mode)
    inner, nodes = len(scheme.inner_unknowns(stance)), len(scheme.node_unknowns(stance))
    unknown = ca.SX.sym("w", stance.n_x + 2 * nodes + inner)
    after, left, right, between = ca.vertsplit(unknown, np.cumsum([0, stance.n_x, nodes, nodes, inner]).tolist())
    p = ca.SX(ca.DM(P))
    start = scheme.node(stance, ca.SX(ca.DM(STATES[mode])), ca.SX(ca.DM(TORQUE)), left, p)
    end = scheme.node(stance, after, ca.SX(ca.DM(TORQUE + RISE * step)), right, p)
    gap, middle = scheme.advance(stance, start, end, between, ca.SX(step), p)
    residual = ca.vertcat(gap, start.residual, end.residual, *[point.residual for point in middle])
    for point in middle:
        if point.definition is not None:
            residual = ca.substitute(residual, point.state, point.definition)
    system = ca.Function("system", [unknown], [residual, ca.jacobian(residual, unknown)])
    guess = np.zeros(unknown.numel())
    guess[: stance.n_x] = STATES[mode]
    found = root(lambda w: np.asarray(system(w)[0]).ravel(), guess, jac=lambda w: np.asarray(system(w)[1]), tol=1e-14)
    assert np.max(np.abs(found.fun)) < 1e-10
    return found.x[: stance.n_x]


def reference(mode, step):
    stance = PhaseDynamics(ROBOT, mode)
    state, torque, p = ca.SX.sym("x", stance.n_x), ca.SX.sym("u", 2), ca.SX.sym("p", len(P))
    flow = ca.Function("flow", [state, torque, p], [stance.flow(state, torque, p)[0]])

    def rate(t, y):
        return np.asarray(flow(y, TORQUE + RISE * t, P)).ravel()

    return solve_ivp(rate, (0, step), STATES[mode], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
