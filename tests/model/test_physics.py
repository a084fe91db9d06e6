"""Comparing robots by their physics: what does not matter, and what differs by name."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import Coordinates, Drawing, Parameter, PointMass, StepEnd, assemble, compass_biped
from gaitopt.model.physics import find_differences, physics_of, sample_physics
from gaitopt.model.robots.compass import PARAMETERS

COMPASS_NAMES = ("th1", "th2", "ankle", "hip")


def biped(
    name="mine",
    names=COMPASS_NAMES,
    *,
    mass=1.0,
    foot=1.0,
    torque=1.0,
    armed=0.0,
    parameters=PARAMETERS,
    order=1,
):
    """Return the compass biped, written in another way and with factors on some of its expressions."""
    c = Coordinates(names[:2], parameters)
    th1, th2 = (c.angle(angle) for angle in names[:2])
    length, com = c.parameter("leg_length"), c.parameter("leg_com")
    hip = ca.vertcat(ca.sin(th1), ca.cos(th1)) * length + c.foot
    swing_foot = hip - foot * length * ca.vertcat(-ca.sin(th2), ca.cos(th2))
    bodies = [
        PointMass(mass * c.parameter("leg_mass"), c.foot * (1 - com / length) + hip * (com / length)),
        PointMass(c.parameter("hip_mass"), hip),
        PointMass(c.parameter("leg_mass"), hip * (com / length) + (1 - com / length) * swing_foot),
    ]
    return assemble(
        name,
        c,
        bodies=bodies[::order],
        step=StepEnd(
            landing=swing_foot, touchdown=th2 - th1, armed=th1 - armed, exchange=[-th2, -th1], upright=ca.cos(th1)
        ),
        actuators={names[2]: torque * th1, names[3]: th2 + th1},
        drawing=Drawing({"somewhere": hip}, []),
    )


def test_names_drawing_and_order_of_operations_do_not_matter():
    for order in (1, -1):
        other = biped(names=("a", "b", "first", "second"), order=order)
        assert find_differences(physics_of(compass_biped()), other) == ()


@pytest.mark.parametrize(
    ("changes", "first"),
    [
        ({"mass": 1.001}, "total mass (by 0.04"),
        ({"mass": 1 + 1e-7}, "total mass (by "),
        ({"foot": 1.01}, "mass matrix (by "),
        ({"torque": 2.0}, "actuation matrix (by "),
        ({"armed": 0.01}, "condition that arms the touchdown (by "),
    ],
)
def test_what_differs_is_named(changes, first):
    found = find_differences(physics_of(compass_biped()), biped(**changes))
    assert found[0].startswith(first)


def test_defaults_of_parameters_do_not_matter_but_parameters_do():
    """The values of a gait are in its file."""
    heavier = tuple(dataclasses.replace(p, default=2 * p.default) for p in PARAMETERS)
    assert find_differences(physics_of(compass_biped()), biped(parameters=heavier)) == ()
    assert find_differences(physics_of(compass_biped()), biped(parameters=PARAMETERS[::-1])) == ()
    further = (*PARAMETERS, Parameter("torso_mass", 1.0, "kg", "mass"))
    assert find_differences(physics_of(compass_biped()), biped(parameters=further)) == (
        "a further parameter 'torso_mass'",
    )
    assert find_differences(physics_of(biped(parameters=further)), compass_biped()) == ("no parameter 'torso_mass'",)


def test_the_states_are_the_same_everywhere():
    """They are written into files, and depend on no random generator."""
    points = physics_of(compass_biped()).points
    np.testing.assert_allclose(points["q"][:, 0], [-0.424482756, -0.248965512, -0.073448268, 0.102068975], atol=1e-8)
    for parameter in compass_biped().parameters:
        for value in points[parameter.name]:
            assert parameter.check(value) == value
            assert np.isfinite(value)


def test_a_value_that_is_not_a_number_differs_from_a_number():
    physics = sample_physics(compass_biped())
    physics.values["total mass"][0, 0] = np.nan
    assert find_differences(physics, compass_biped()) == ("total mass",)
