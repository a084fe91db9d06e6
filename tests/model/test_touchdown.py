"""The touchdown as a transition: its guard, its reset and its conditions."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Mode, compass_biped
from gaitopt.model import solve_impact
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.contacts.transition import Condition

ROBOT = compass_biped()
Q, V = np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.6, -0.1])


def numbers(expression, *arguments):
    symbols = [ca.SX.sym("argument", len(argument)) for argument in arguments]
    value = ca.Function("value", symbols, [expression(*symbols)])(*arguments)
    return np.asarray(value).ravel()


@pytest.mark.parametrize(("friction", "outcome"), [(0.5, Mode.STICK), (0.05, Mode.SLIP_BACKWARD)])
def test_the_reset_is_the_simulated_impact_and_leg_exchange(friction, outcome):
    p = ROBOT.vector(ROBOT.resolve({"friction": friction}))
    impact = solve_impact(ROBOT, Q, V, p)
    outcome = impact.mode if outcome.slips else outcome
    assert impact.mode is outcome
    expected = np.concatenate([np.asarray(part).ravel() for part in ROBOT.swap(Q, impact.v_plus, p)])
    reset = numbers(lambda q, v, p: Touchdown(ROBOT).reset(outcome, q, v, p), Q, V, p)
    np.testing.assert_allclose(reset, expected, atol=1e-13)


def test_the_guard_is_that_of_the_robot():
    p = ROBOT.vector(ROBOT.resolve({}))
    guard, _, armed = (float(part) for part in ROBOT.touchdown(Q, V, p))
    assert numbers(lambda *state: ca.vertcat(*Touchdown(ROBOT).guard(*state)), Q, V, p).tolist() == [guard, armed]


def test_the_conditions_are_a_descending_armed_guard_and_a_separating_foot():
    touchdown, p = Touchdown(ROBOT), ROBOT.vector(ROBOT.resolve({}))
    conditions = touchdown.conditions(ca.SX(Q), ca.SX(V), ca.SX([0, 0.3, 0, 0]), ca.SX(p))
    assert [one.condition for one in conditions] == [
        Condition.TOUCHDOWN,
        Condition.TOUCHDOWN_DIRECTION,
        Condition.TOUCHDOWN_AHEAD,
        Condition.SEPARATION,
    ]
    assert [(one.equality, one.nonpositive) for one in conditions] == [
        (True, False),
        (False, True),
        (False, False),
        (False, False),
    ]
    values = [float(one.value) for one in conditions]
    assert values == pytest.approx([*(float(part) for part in ROBOT.touchdown(Q, V, p)), 0.3])
