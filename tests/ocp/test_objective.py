from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import CostOfTransport, InputError, Objective, PositiveWork, TorqueSquared
from gaitopt.ocp.statement.objective import OBJECTIVES, check_objective, objective_named

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


@pytest.mark.parametrize("share", [-0.1, 1.0, float("nan"), "half"])
def test_a_share_that_cannot_be_regenerated_is_refused(share):
    with pytest.raises(InputError, match="regeneration"):
        PositiveWork(regeneration=share)


def test_regeneration_gives_back_a_share_of_the_negative_work():
    # +3 W and -2 W with half of the braking power stored: 3 - 1.
    assert value(PositiveWork(regeneration=0.5), np.zeros(2), np.array([3.0, -2.0])) == pytest.approx(2.0)


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


class Own(TorqueSquared):
    """An objective of a user, with one mistake at a time."""

    name = "own"

    def __init__(self, integrand):
        object.__setattr__(self, "own", integrand)

    def integrand(self, torque, positive, negative):
        return self.own(torque)


def test_an_integrand_that_is_no_number_is_refused_with_its_shape():
    with pytest.raises(InputError, match=r"integrand of Own must be one number, it is a table of 2 x 1: sum it"):
        check_objective(Own(lambda torque: torque), 2)
    check_objective(Own(lambda torque: 3.0), 2)


def test_an_objective_that_does_not_say_what_it_is_is_refused():
    class Nameless(Objective):
        uses_power = per_weight_and_travel = smooth = False

        def integrand(self, torque, positive, negative):
            return ca.sumsqr(torque)

    with pytest.raises(InputError, match="Nameless does not say its name: set it in the class"):
        check_objective(Nameless(), 2)


def test_an_objective_that_cannot_be_told_from_others_is_refused():
    @dataclass
    class Mutable(Objective):
        weight: float = 1.0
        name, uses_power, per_weight_and_travel, smooth = "mutable", False, False, True

        def integrand(self, torque, positive, negative):
            return self.weight * ca.sumsqr(torque)

    with pytest.raises(InputError, match="Mutable cannot be told from others: make its class a frozen dataclass"):
        check_objective(Mutable(), 2)
