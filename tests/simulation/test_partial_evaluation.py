"""Separated Functions are the Functions they were made from, with all that rests computed outside."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Mode, compass_biped, feedforward, passive, rimless_wheel
from gaitopt.simulation.closed_loop import mode_equations
from gaitopt.simulation.taylor.partial_evaluation import split_expression

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]
SYMBOLS = [ca.SX.sym("t"), ca.SX.sym("y", 3), ca.SX.sym("p", 2), ca.SX.sym("data", 0)]


def separated(function, entries):
    """Return the first output of a Function as computed by its parts."""
    parts = split_expression(function, entries)

    def evaluate(t, y, p, data=()):
        values = parts.numbers(p, data, y)
        return np.asarray(parts.body.call([t, np.asarray(y)[list(entries)], values])[0]).ravel()

    return evaluate


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("robot", [compass_biped(), rimless_wheel()], ids=["compass", "wheel"])
@pytest.mark.parametrize("name", ["flow", "guards", "energy"])
def test_closed_loops_keep_their_values(robot, mode, name, rng):
    loop = mode_equations(robot, mode, passive(robot).torque)
    function = getattr(loop, name)
    evaluate = separated(function, loop.active)
    for _ in range(10):
        p, y = rng.uniform(0.3, 1.5, len(robot.parameters)), rng.uniform(-0.7, 0.7, 2 * robot.n_q)
        p[:3] += [2, 0, 0]  # a leg longer than where its mass is
        expected = np.asarray(function.call([0.3, y, p, []])[0]).ravel()
        np.testing.assert_allclose(evaluate(0.3, y, p), expected, rtol=1e-13, atol=1e-13)


def test_law_with_pieces_keeps_its_values(slip_gait, rng):
    robot, law = compass_biped(), feedforward(compass_biped(), slip_gait.motion)
    loop, p = mode_equations(robot, Mode.STICK, law.torque), rng.uniform(0.5, 1.5, len(robot.parameters))
    evaluate = separated(loop.flow, range(8))
    for piece in (0, 5, law.table.shape[1] - 1):
        y, data = rng.uniform(-0.5, 0.5, 8), law.table[:, piece]
        expected = np.asarray(loop.flow(0.4, y, p, data)).ravel()
        np.testing.assert_allclose(evaluate(0.4, y, p, data), expected, rtol=1e-13, atol=1e-13)


def test_nothing_in_the_body_rests():
    _, y, p, _ = SYMBOLS
    rests = ca.sin(p[0]) * ca.sqrt(p[1]) / (1 + y[0])
    parts = split_expression(ca.Function("f", SYMBOLS, [rests * y[1] * y[2], rests, ca.SX(3)]), [1, 2])
    assert parts.numbers.numel_out(0) == 1
    multiplications = [k for k in range(parts.body.n_instructions()) if parts.body.instruction_id(k) == ca.OP_MUL]
    assert (parts.body.numel_in(2), len(multiplications)) == (1, 2)


def test_entries_count_as_numbers_only_where_they_rest():
    _, y, p, _ = SYMBOLS
    function = ca.Function("f", SYMBOLS, [p[0] * y[0] + y[2]])
    for entries, felt in (([0, 2], 0), ([2], 1), ([0, 1, 2], 0)):
        assert split_expression(function, entries).numbers.jac_sparsity(0, 2).nnz() == felt


@pytest.mark.parametrize(
    "expression",
    [
        lambda t, y, p: ca.tanh(p[0] * y[0]) * ca.exp(-t) + ca.atan2(y[1], 2 + y[2]),
        lambda t, y, p: ca.if_else(y[0] < y[1], y[0] ** 2, ca.fabs(y[1])) * p[1],
        lambda t, y, p: ca.sqrt(1 + y[0] ** 2) ** 3 / (y[1] + 2) / (2 * y[1] + 4),
        lambda t, y, p: ca.sin(-y[0]) + ca.cos(p[0] - y[1]) * ca.sin(3) + ca.sqrt(ca.fabs(p[0])) ** p[1],
        lambda t, y, p: ca.SX(0.25),
        lambda t, y, p: p[0] - p[0] + 0 * y[0],
    ],
    ids=["smooth", "branches", "roots", "shifts", "constant", "nothing"],
)
def test_any_expression_keeps_its_value(expression, rng):
    function = ca.Function("f", SYMBOLS, [ca.densify(expression(*SYMBOLS[:3]))])
    for entries in ([0, 1, 2], [1], [0, 2]):
        evaluate = separated(function, entries)
        for _ in range(5):
            t, y, p = rng.uniform(0, 1), rng.uniform(-1, 1, 3), rng.choice([-1, 1], 2) * rng.uniform(0.3, 1.5, 2)
            expected = np.asarray(function(t, y, p, [])).ravel()
            np.testing.assert_allclose(evaluate(t, y, p), expected, rtol=1e-14, atol=1e-14)
