"""Riccati equations against scipy's algebraic ones."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are, solve_discrete_are

from gaitopt.tuning.riccati import LinearInterval, discrete_gains, periodic_gains

A, B = np.array([[0.0, 1.0], [2.0, -0.1]]), np.array([[0.0], [1.5]])
Q, R = np.diag([3.0, 1.0]), np.array([[0.5]])


def test_steady_motion_without_jumps_is_the_algebraic_equation():
    gains, cost = periodic_gains([LinearInterval(0.05, A, B, np.eye(2))] * 10, Q, R)
    exact = solve_continuous_are(A, B, Q, R)
    assert cost == pytest.approx(exact, rel=1e-8)
    assert gains[3, 0] == pytest.approx(np.linalg.solve(R, B.T @ exact), rel=1e-8)


def test_jumps_are_part_of_the_step():
    # Without input between jumps the periodic equation is a discrete Lyapunov equation of one jump and one stretch.
    jump = np.array([[0.5, 0.1], [0.0, 0.4]])
    still = np.zeros((2, 2))
    _, cost = periodic_gains([LinearInterval(0.2, still, np.zeros((2, 1)), jump)], Q, R)
    assert cost == pytest.approx(jump.T @ cost @ jump + 0.2 * Q, rel=1e-8)


def test_what_cannot_be_stabilised_is_none():
    assert periodic_gains([LinearInterval(0.1, A, np.zeros((2, 1)), np.eye(2))], Q, R) is None
    assert periodic_gains([LinearInterval(0.1, 400 * np.eye(2), 1e-6 * B, np.eye(2))] * 3, Q, R) is None
    assert discrete_gains(2 * np.eye(2), np.zeros((2, 1)), Q, R) is None


def test_discrete_gains_are_those_of_the_algebraic_equation():
    a, b = np.array([[1.1, 0.2], [0.0, 0.7]]), np.array([[0.1], [1.0]])
    exact = solve_discrete_are(a, b, Q, R)
    expected = np.linalg.solve(R + b.T @ exact @ b, b.T @ exact @ a)
    assert discrete_gains(a, b, Q, R) == pytest.approx(expected, rel=1e-8)
