"""Reduced Functions are the Functions they were made from, with less to do for an integrator."""

from collections import Counter

import casadi as ca
import numpy as np
import pytest

from gaitopt import Mode, compass_biped, feedforward, passive, rimless_wheel
from gaitopt.simulation.closed_loop import closed_loop
from gaitopt.simulation.reduction import reduce_function

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]
SYMBOLS = [ca.SX.sym("t"), ca.SX.sym("y", 3), ca.SX.sym("p", 2), ca.SX.sym("data", 0)]


def reducer(function, entries):
    """Return the first output of a Function as computed by what it is reduced to."""
    reduced = reduce_function(function, entries)

    def evaluate(t, y, p, data=()):
        values = reduced.coefficients(p, data, y)
        return np.asarray(reduced.body.call([t, np.asarray(y)[list(entries)], values])[0]).ravel()

    return evaluate


def products(function):
    """Return how many products and quotients of two results a Function takes, inputs of coefficients not counted."""
    fixed, count = set(), Counter()
    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        if operation == ca.OP_CONST or (operation == ca.OP_INPUT and sources[0] == 2):
            fixed.add(function.instruction_output(k)[0])
        elif operation != ca.OP_OUTPUT:
            if operation != ca.OP_INPUT and not fixed.intersection(sources):
                count[operation] += 1
            fixed.discard(function.instruction_output(k)[0])
    return count[ca.OP_MUL] + count[ca.OP_DIV] + count[ca.OP_SQ]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("robot", [compass_biped(), rimless_wheel()], ids=["compass", "wheel"])
@pytest.mark.parametrize("name", ["flow", "guards", "energy"])
def test_closed_loops_keep_their_values(robot, mode, name, rng):
    loop = closed_loop(robot, mode, passive(robot).torque)
    function = getattr(loop, name)
    reduced = reducer(function, loop.active)
    for _ in range(10):
        p, y = rng.uniform(0.3, 1.5, len(robot.parameters)), rng.uniform(-0.7, 0.7, 2 * robot.n_q)
        p[:3] += [2, 0, 0]  # a leg longer than where its mass is
        expected = np.asarray(function.call([0.3, y, p, []])[0]).ravel()
        scale = 1e-9 * (1 + np.abs(expected).max())
        np.testing.assert_allclose(reduced(0.3, y, p), expected, atol=scale)


def test_law_with_pieces_keeps_its_values(slip_gait, rng):
    robot, law = compass_biped(), feedforward(compass_biped(), slip_gait.motion)
    loop, p = closed_loop(robot, Mode.STICK, law.torque), rng.uniform(0.5, 1.5, 7)
    reduced = reducer(loop.flow, range(8))
    for piece in (0, 5, law.table.shape[1] - 1):
        y, data = rng.uniform(-0.5, 0.5, 8), law.table[:, piece]
        expected = np.asarray(loop.flow(0.4, y, p, data)).ravel()
        np.testing.assert_allclose(reduced(0.4, y, p, data), expected, rtol=1e-11, atol=1e-11)


def test_light_legs_lose_no_digits(rng):
    # The simplest walker: the legs' own equations are a millionth of the rest.
    robot = compass_biped()
    p = robot.vector(robot.resolve({"leg_mass": 1e-6, "hip_mass": 1, "leg_com": 0, "leg_length": 1, "gravity": 1}))
    loop = closed_loop(robot, Mode.STICK, passive(robot).torque)
    reduced = reducer(loop.flow, loop.active)
    for _ in range(10):
        y = np.array([0, 0, *rng.uniform(-0.3, 0.3, 2), 0, 0, *rng.uniform(-0.3, 0.3, 2)])
        expected = np.asarray(loop.flow(0, y, p, [])).ravel()
        np.testing.assert_allclose(reduced(0, y, p), expected, rtol=1e-11)


def test_less_is_left_to_do():
    robot = compass_biped()
    for mode, most in ((Mode.STICK, 25), (Mode.SLIP_FORWARD, 50)):
        loop = closed_loop(robot, mode, passive(robot).torque)
        body = reduce_function(loop.guards, loop.active).body
        assert products(body) <= most < products(loop.guards)


def test_identities_of_sine_and_cosine_are_found():
    _, y, p, _ = SYMBOLS
    a, b = y[0] + p[0], 2 * y[1] - y[0]
    vanishing = ca.sin(a) * ca.cos(b) + ca.cos(a) * ca.sin(b) - ca.sin(2 * y[1] + p[0]) + (p[0] + p[1]) ** 2 - p[0] ** 2
    rest = vanishing - 2 * p[0] * p[1] - p[1] ** 2
    body = reduce_function(ca.Function("f", SYMBOLS, [rest * ca.exp(y[2])]), range(3)).body
    assert [body.instruction_id(k) for k in range(body.n_instructions())] == [ca.OP_CONST, ca.OP_OUTPUT]


@pytest.mark.parametrize(
    "expression",
    [
        lambda t, y, p: ca.tanh(p[0] * y[0]) * ca.exp(-t) + ca.atan2(y[1], 2 + y[2]),
        lambda t, y, p: ca.if_else(y[0] < y[1], y[0] ** 2, ca.fabs(y[1])) * p[1],
        lambda t, y, p: ca.sin(p[0] * t) * ca.cos(0.5 * y[0]) + ca.sin(y[0] * y[1]),
        lambda t, y, p: ca.sqrt(1 + y[0] ** 2) ** 3 / (y[1] + 2) / (2 * y[1] + 4),
        lambda t, y, p: ca.sin(-y[0]) + ca.cos(p[0] - y[1]) * ca.sin(3) + ca.sqrt(p[0]) ** p[1],
        lambda t, y, p: (y[0] + y[1]) ** 7 - (y[0] - y[1]) ** 7,
        lambda t, y, p: ca.fabs(p[0]) * y[0] + ca.sqrt(p[1] ** 2) * y[1] + ca.fmin(p[0], 9) * ca.tanh(99 * p[1]) * y[2],
        lambda t, y, p: ca.SX(0.25),
        lambda t, y, p: p[0] - p[0] + 0 * y[0],
    ],
    ids=["smooth", "branches", "waves", "roots", "shifts", "powers", "parameters", "constant", "nothing"],
)
def test_any_expression_keeps_its_value(expression, rng):
    function = ca.Function("f", SYMBOLS, [expression(*SYMBOLS[:3])])
    for entries in ([0, 1, 2], [1], [0, 2]):
        reduced = reducer(function, entries)
        for _ in range(5):
            t, y, p = rng.uniform(0, 1), rng.uniform(-1, 1, 3), rng.choice([-1, 1], 2) * rng.uniform(0.3, 1.5, 2)
            expected = np.asarray(function(t, y, p, [])).ravel()
            np.testing.assert_allclose(reduced(t, y, p), expected, rtol=1e-12, atol=1e-12)
