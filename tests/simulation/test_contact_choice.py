"""The choice of contact mode, case by case, against the sticking force by hand."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import Law, Mode
from gaitopt.control.signature import torque_function
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.contact_choice import ContactChoice

Q, V, TORQUE = np.array([0, 0, -0.15, -0.15]), np.array([0, 0, 0.75, -0.5]), np.zeros(2)


def choice(compass, hand_compass, mu, *, v=V, torque=TORQUE, leaving=None):
    """Return what is chosen under a constant torque."""
    data = ca.SX.sym("data", 2)
    law = Law("constant", torque_function(compass, data, lambda clock, q, v: data), np.zeros(1), torque[:, None])
    hand = dataclasses.replace(hand_compass, mu=mu)
    contact = ContactChoice(ClosedLoop(compass, law, compass.vector(compass.resolve(hand.parameters))))
    return contact.choose(0.1, np.concatenate([Q, v]), leaving=leaving)


@pytest.fixture
def ratio(hand_compass):
    _, (tangential, normal) = hand_compass.stick(Q[2:], V[2:], TORQUE)
    return tangential / normal


@pytest.mark.parametrize("speed", [0.1, -0.1, 1e-11, -1e-11])
def test_a_moving_foot_slides(compass, hand_compass, speed):
    v = np.array([speed, 0, 0.75, -0.5])
    for mu in (0.0, 0.5):
        assert choice(compass, hand_compass, mu, v=v) is Mode.slipping(speed)


def test_a_foot_at_rest_sticks_inside_the_cone_and_slides_against_the_force_outside(compass, hand_compass, ratio):
    assert ratio < 0
    assert choice(compass, hand_compass, -ratio * 1.0001) is Mode.STICK
    assert choice(compass, hand_compass, -ratio * 0.9999) is Mode.SLIP_FORWARD
    assert choice(compass, hand_compass, np.inf) is Mode.STICK


def test_torque_counts(compass, hand_compass, ratio):
    torque = np.array([60.0, 0.0])
    _, (tangential, normal) = hand_compass.stick(Q[2:], V[2:], torque)
    assert tangential > abs(ratio) * normal
    assert choice(compass, hand_compass, -ratio * 1.0001, torque=torque) is Mode.SLIP_BACKWARD


def test_a_slip_that_has_come_to_rest_is_not_chosen_again(compass, hand_compass):
    assert choice(compass, hand_compass, 0.05) is Mode.SLIP_FORWARD
    assert choice(compass, hand_compass, 0.05, leaving=Mode.SLIP_FORWARD) is Mode.STICK
    assert choice(compass, hand_compass, 0.05, leaving=Mode.SLIP_BACKWARD) is Mode.SLIP_FORWARD


def test_speeds_at_rounding_level_are_rest(compass, hand_compass):
    assert choice(compass, hand_compass, 10.0, v=np.array([1e-13, 0, 0.75, -0.5])) is Mode.STICK
