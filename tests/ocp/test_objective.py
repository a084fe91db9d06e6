from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import (
    ContactSequence,
    CostOfTransport,
    InputError,
    Objective,
    PositiveWork,
    TorqueSquared,
    compass_biped,
)
from gaitopt.ocp import TorqueRate
from gaitopt.ocp.statement.instant import symbolic_instant
from gaitopt.ocp.statement.objective import check_objective
from gaitopt.ocp.statement.objective_names import OBJECTIVES, objective_named
from tests.ocp.nlp_examples import example_nlp

COMPASS = compass_biped()
REAL = st.floats(-10, 10)


def value(objective, torque, power):
    """Return an integrand at an instant of given torques and powers."""
    columns = {"torque": torque, "positive": np.maximum(power, 0), "negative": np.maximum(-power, 0)}
    return float(ca.DM(objective.integrand(instant(**columns))))


def instant(**columns):
    """Return an instant of the compass biped with some of its columns given."""
    symbols = symbolic_instant(COMPASS.angles, COMPASS.actuators, [])
    return replace(symbols, **{name: ca.DM(column) for name, column in columns.items()})


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


@pytest.mark.parametrize("name", OBJECTIVES)
def test_every_objective_is_known_by_its_name(name):
    assert objective_named(name).name == name
    assert type(objective_named(name)) is OBJECTIVES[name]


def test_an_objective_stands_for_itself():
    objective = TorqueSquared()
    assert objective_named(objective) is objective


def test_equal_objectives_share_a_transcription():
    """Objectives made twice build one NLP, and another parameter or weight builds another."""

    def built(objective):
        return example_nlp(ContactSequence.parse("stick | stick"), (3,), objective)

    assert built(PositiveWork(regeneration=0.3)) is built(PositiveWork(regeneration=0.3))
    assert built(PositiveWork(regeneration=0.3)) is not built(PositiveWork(regeneration=0.2))
    assert built(2 * TorqueSquared() + TorqueRate()) is built(2 * TorqueSquared() + TorqueRate())
    assert built(2 * TorqueSquared() + TorqueRate()) is not built(3 * TorqueSquared() + TorqueRate())


@pytest.mark.parametrize(
    ("name", "fault"),
    [("torque_sqared", "no objective 'torque_sqared'"), (3, "a name or an Objective, got 3"), (None, "got None")],
)
def test_an_unknown_objective_lists_the_known_ones(name, fault):
    with pytest.raises(InputError, match=rf"{fault}.*Known: cost_of_transport, torque_squared, positive_work"):
        objective_named(name)


def test_an_objective_without_any_term_is_refused():
    class Nothing(Objective):
        name = "nothing"

    with pytest.raises(
        InputError, match=r"Nothing defines no integrand, boundary or peak: define integrand\(self, point\)"
    ):
        check_objective(Nothing(), COMPASS)


class Own(TorqueSquared):
    """An objective of a user, with one mistake at a time."""

    name = "own"

    def __init__(self, integrand):
        object.__setattr__(self, "own", integrand)

    def integrand(self, point):
        return self.own(point)


def test_an_integrand_that_is_no_number_is_refused_with_its_shape():
    with pytest.raises(InputError, match=r"integrand of Own must be one number, got a table of 2 x 1: sum it"):
        check_objective(Own(lambda point: point.torque), COMPASS)
    check_objective(Own(lambda point: 3.0), COMPASS)


def test_powers_without_uses_power_are_refused():
    with pytest.raises(InputError, match="integrand of Own contains parts of the joint powers: set uses_power = True"):
        check_objective(Own(lambda point: ca.sum1(point.positive)), COMPASS)


def test_an_integrand_of_the_older_signature_is_refused_with_what_to_write():
    class Older(Objective):
        name = "older"

        def integrand(self, torque, positive, negative):
            return ca.sumsqr(torque)

    sentence = r"integrand of Older must take one argument, got \(torque, positive, negative\): write integrand\(self"
    with pytest.raises(InputError, match=sentence):
        check_objective(Older(), COMPASS)


def test_an_objective_that_does_not_say_what_it_is_is_refused():
    class Nameless(Objective):
        def integrand(self, point):
            return ca.sumsqr(point.torque)

    with pytest.raises(InputError, match="Nameless has no name: set the class attribute name"):
        check_objective(Nameless(), COMPASS)


def test_an_objective_that_cannot_be_told_from_others_is_refused():
    @dataclass
    class Mutable(Objective):
        weight: float = 1.0
        name = "mutable"

        def integrand(self, point):
            return self.weight * ca.sumsqr(point.torque)

    with pytest.raises(InputError, match="Mutable is not hashable: make its class a frozen dataclass"):
        check_objective(Mutable(), COMPASS)
    with pytest.raises(InputError, match="Mutable is not hashable"):
        check_objective(TorqueSquared() + Mutable(), COMPASS)


@pytest.mark.parametrize("weight", [0, -1.0, float("nan"), float("inf"), "half", True])
def test_a_weight_that_is_not_positive_is_refused(weight):
    with pytest.raises(InputError, match="The weight of an objective must be a finite positive number"):
        weight * TorqueRate()


def test_weights_multiply_through_a_sum():
    mixed = 2 * (TorqueSquared() + 3 * TorqueRate())
    assert mixed.terms() == ((2.0, TorqueSquared()), (6.0, TorqueRate()))
    assert mixed == 2 * TorqueSquared() + 6 * TorqueRate()
    assert mixed.name == "2 torque_squared + 6 torque_rate"
    assert mixed.smooth
    assert not (mixed + CostOfTransport()).smooth
    assert (mixed.unit, (2 * TorqueRate()).unit) == ("", "N^2 m^2/s")


def test_a_motion_with_several_contacts_is_refused(hop_gait):
    for objective in (TorqueSquared(), 2 * TorqueSquared()):
        with pytest.raises(InputError, match=r"robot with several contacts .* gait\.solver\.objective"):
            objective.evaluate(hop_gait.motion)
