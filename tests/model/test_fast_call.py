"""FastCall calls give what plain calls give, in separate memory."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, Mode
from gaitopt.model.fast_call import FastCall


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_buffered_call_equals_plain_call(request, rng, name):
    robot = request.getfixturevalue(name)
    p = robot.vector(robot.resolve({"friction": 0.3}))
    functions = [robot.collision, robot.dynamics, robot.swap]
    for function in functions:
        fast = FastCall(function, p)
        for _ in range(3):
            q, v = rng.normal(size=(2, robot.n_q))
            for quick, plain in zip(fast(q, v), function(q, v, p), strict=True):
                np.testing.assert_array_equal(quick, np.asarray(plain.full()).ravel(order="F"))


def test_results_live_until_the_next_call_only_and_inputs_are_copied(compass, rng):
    p = compass.vector(compass.resolve({}))
    fast = FastCall(compass.acceleration[Mode.STICK], p)
    q, v, u = rng.normal(size=4), rng.normal(size=4), rng.normal(size=2)
    first = fast(q, v, u)[0]
    kept = first.copy()
    assert fast(q + 1, v, u)[0] is first
    assert not np.array_equal(first, kept)
    p[:] = np.nan  # the fixed values were taken when it was made
    np.testing.assert_array_equal(fast(q, v, u)[0], kept)


def test_two_buffers_of_one_function_do_not_share_memory(compass, rng):
    p = compass.vector(compass.resolve({}))
    one, two = FastCall(compass.landing, p), FastCall(compass.landing, p)
    q, v = rng.normal(size=4), rng.normal(size=4)
    result = one(q, v)[0]
    kept = result.copy()
    two(q + 1, v)
    np.testing.assert_array_equal(result, kept)


def test_wrong_number_of_values_is_refused(compass):
    fast = FastCall(compass.landing, compass.vector(compass.resolve({})))
    with pytest.raises(ValueError, match="zip"):
        fast([0, 0, 0, 0])


def test_memory_of_another_size_is_refused():
    x = ca.SX.sym("x", 3)
    for memory in (np.zeros(2), np.zeros((3, 2))[:, 0]):
        with pytest.raises(InputError, match="contiguous array of 3 numbers"):
            FastCall(ca.Function("double", [x], [2 * x]), shared=memory)
