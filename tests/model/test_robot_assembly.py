"""Robots assembled from parts: a rod that can be checked by hand, and every mistake named."""

import math
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Coordinates,
    Drawing,
    InputError,
    Mode,
    Parameter,
    PointMass,
    RigidLink,
    StepEnd,
    assemble,
    check_robot,
)
from gaitopt.model import robot_named
from gaitopt.model.contacts.mode import PHYSICAL

GRAVITY = Parameter("gravity", 9.8, "m/s^2", "gravity", lower=0.0)


def rod(bodies=None, relabel=None, **changes):
    """Return a rimless wheel of which one spoke is drawn, made of whatever bodies are given."""
    c = Coordinates(["th"], [GRAVITY])
    th = c.angle("th")
    end = c.foot + ca.vertcat(ca.sin(th), ca.cos(th))
    step = {
        "landing": end - ca.vertcat(ca.sin(th - 0.6), ca.cos(th - 0.6)),
        "touchdown": 0.3 - th,
        "armed": th,
        "exchange": [relabel(th)] if relabel else [th - 0.6],
        "upright": ca.cos(th),
    }
    step |= {name: changes.pop(name) for name in list(changes) if name in step}
    parts = {
        "description": "a rod",
        "bodies": bodies(c, th) if bodies else [PointMass(2.0, end)],
        "step": StepEnd(**step),
        "actuators": {"ankle": th},
        "drawing": Drawing({"foot": c.foot, "end": end}, [("foot", "end")]),
    }
    return assemble("rod", c, **{**parts, **changes})


def test_a_rod_is_the_same_as_the_two_masses_it_is_made_of():
    """A rigid link of mass 2, inertia I about its middle is two masses 1 at +-sqrt(I/2) from it."""
    reach = 0.3

    def link(c, th):
        middle = c.foot + ca.vertcat(ca.sin(th), ca.cos(th))
        return [RigidLink(2.0, middle, 2 * reach**2, th)]

    def masses(c, th):
        direction = ca.vertcat(ca.sin(th), ca.cos(th))
        return [PointMass(1.0, c.foot + (1 + side) * direction) for side in (-reach, reach)]

    robots = [rod(link), rod(masses)]
    for robot in robots:
        assert check_robot(robot, states=4).passed
    q, v, u = [0.1, 0.2, 0.4], [0.5, 0.0, 1.1], [0.7]
    for mode in PHYSICAL:
        results = [
            [
                np.asarray(part).ravel()
                for part in robot.acceleration[mode](q, v, u, robot.vector(robot.resolve({"friction": 0.3})))
            ]
            for robot in robots
        ]
        np.testing.assert_allclose(results[0][0], results[1][0], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(results[0][1], results[1][1], rtol=1e-12, atol=1e-12)


def test_torque_balances_gravity_where_statics_says():
    robot = rod()
    p = robot.vector(robot.resolve({"slope": 0.1}))
    torque = -2.0 * 9.8 * np.sin(0.4 + 0.1)
    acceleration, force = robot.acceleration[Mode.STICK]([0, 0, 0.4], [0, 0, 0], [torque], p)
    np.testing.assert_allclose(np.asarray(acceleration).ravel(), 0.0, atol=1e-14)
    np.testing.assert_allclose(np.asarray(force).ravel(), 2 * 9.8 * np.array([-np.sin(0.1), np.cos(0.1)]), rtol=1e-13)


def test_a_robot_knows_its_sizes_and_names():
    robot = rod()
    assert (robot.n_q, robot.n_u, robot.links) == (3, 1, ((0, 1),))
    assert [parameter.name for parameter in robot.parameters] == [
        "gravity",
        "slope",
        "friction",
        "static_friction_ratio",
    ]
    ground = {"slope": 0.1, "friction": np.inf, "static_friction_ratio": 1.0}
    assert robot.resolve({"slope": 0.1}) == {"gravity": 9.8, **ground}
    assert "rod" in repr(robot)


def test_relabelling_must_be_linear():
    with pytest.raises(InputError, match=r"'rod'.*linear"):
        rod(relabel=lambda th: th**2)


def test_relabelling_must_be_invertible():
    with pytest.raises(InputError, match=r"'rod'.*must be invertible"):
        rod(relabel=lambda th: 0 * th)


def test_relabelling_needs_every_angle():
    with pytest.raises(InputError, match="one for each"):
        rod(relabel=lambda th: ca.vertcat(th, th))


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            lambda c, th: {"bodies": lambda *_: [PointMass(1, ca.vertcat(c.foot, 0))]},
            r"position of body 1 must be a point of the plane, .* got shape \(3, 1\)",
        ),
        (lambda c, th: {"landing": c.foot[1]}, r"position of the landing foot must be a point .* got shape \(1, 1\)"),
        (lambda c, th: {"upright": c.foot}, r"upright must be a single expression .* got shape \(2, 1\)"),
        (lambda c, th: {"actuators": {"ankle": c.foot}}, "actuator 'ankle' must be a single expression"),
        (
            lambda c, th: {"actuators": {"ankle": math.sin(th)}},
            "actuator 'ankle' contains nan: either a number in it is nan, or a function of the",
        ),
    ],
)
def test_expressions_of_a_wrong_shape_or_of_the_module_math_are_named(part, message):
    c = Coordinates(["th"], [GRAVITY])
    with pytest.raises(InputError, match=f"Robot 'rod': {message}"):
        rod(**part(c, c.angle("th")))


def test_slope_and_friction_belong_to_the_ground():
    message = "'slope', 'friction', 'static_friction_ratio' are names of the ground's parameters"
    with pytest.raises(InputError, match=message):
        Coordinates(["th"], [GRAVITY, Parameter("slope", 0.0, "rad", "mine")])


def test_a_robot_needs_gravity():
    with pytest.raises(InputError, match="must include 'gravity'"):
        Coordinates(["th"], [])


def test_unknown_parameter_is_named_with_the_nearest_known_one(compass):
    with pytest.raises(InputError, match=r"'compass_biped' has no parameter 'leg_mas'. Did you mean 'leg_mass'\?"):
        compass.resolve({"leg_mas": 3})


def test_unknown_robot_is_named_with_the_nearest_known_one():
    with pytest.raises(InputError, match=r"no robot 'compas_biped'.*Did you mean 'compass_biped'\?.*rimless_wheel"):
        robot_named("compas_biped")


def test_the_catalogue_returns_one_object_for_each_robot(compass):
    assert robot_named("compass_biped") is compass


@pytest.mark.parametrize(
    ("what", "changes"),
    [
        ("touchdown", {"touchdown": ca.SX.sym("theta")}),
        ("point 'end'", {"drawing": Drawing({"end": ca.vertcat(ca.SX.sym("theta"), 0)})}),
        ("actuator 'ankle'", {"actuators": {"ankle": 2 * ca.SX.sym("theta")}}),
        ("mass of body 1", {"bodies": lambda c, th: [PointMass(ca.SX.sym("theta"), c.foot)]}),
        ("exchanged angle 1", {"relabel": lambda th: ca.SX.sym("theta") - th}),
    ],
)
def test_a_symbol_from_elsewhere_is_named_at_once(what, changes):
    with pytest.raises(InputError, match=f"{what} depends on a symbol 'theta'"):
        rod(**changes)


def test_rates_are_named_where_only_the_place_counts():
    c = Coordinates(["th"], [GRAVITY])
    th, tip = c.angle("th"), c.foot + ca.vertcat(ca.sin(c.angle("th")), ca.cos(c.angle("th")))
    end = {"landing": tip, "touchdown": 1 - th, "armed": c.v[2], "exchange": [-th]}
    parts = {"bodies": [PointMass(1.0, tip)], "actuators": {}}
    rates = assemble("rod", c, step=StepEnd(upright=ca.cos(th), **end), **parts)
    assert float(rates.touchdown([0, 0, 0], [0, 0, 2], [9.8, 0, 1, 1])[2]) == 2
    with pytest.raises(InputError, match="upright depends on a symbol 'v_2' that does not belong to its"):
        assemble("rod", c, step=StepEnd(upright=ca.cos(th) + c.v[2], **end), **parts)


def test_a_robot_that_was_used_in_part_can_be_pickled():
    robot = rod()
    q, v, u, p = [0.1, 0.2, 0.4], [0.5, 0.0, 1.1], [0.7], robot.vector(robot.resolve({"friction": 0.3}))
    before = robot.acceleration[Mode.STICK](q, v, u, p)
    again = pickle.loads(pickle.dumps(robot))
    assert list(again.acceleration) == list(robot.acceleration) == list(PHYSICAL)
    assert [float(part) for part in again.energy(q, v, p)] == [float(part) for part in robot.energy(q, v, p)]
    np.testing.assert_array_equal(again.acceleration[Mode.STICK](q, v, u, p)[0], before[0])
    with pytest.raises(KeyError):
        robot.acceleration[Mode.ANY]


def test_a_bound_must_be_a_parameter():
    with pytest.raises(InputError, match=r"The upper bound 'hight' of mark is not a parameter. Did you mean 'height'"):
        Coordinates(
            ["th"], [GRAVITY, Parameter("height", 1.0, "m", ""), Parameter("mark", 0.5, "m", "", at_most="hight")]
        )


def test_threads_share_one_function_of_a_mode():
    gate, robot = threading.Barrier(4, timeout=10), rod()

    def asked(_):
        gate.wait()
        return robot.acceleration[Mode.STICK]

    with ThreadPoolExecutor(4) as pool:
        assert len({id(function) for function in pool.map(asked, range(4))}) == 1
