"""The compass biped in relative coordinates: the angle of the stance leg, and the angle between the legs."""

import functools

import casadi as ca

from gaitopt import Coordinates, Drawing, PointMass, StepEnd, assemble
from gaitopt.model.robots.compass import PARAMETERS


@functools.cache
def relative_compass():
    """Return the compass biped with the angles ``leg`` = th1 and ``between`` = th1 + th2."""
    c = Coordinates(("leg", "between"), PARAMETERS)
    leg, between = c.angle("leg"), c.angle("between")
    length, com, mass = c.parameter("leg_length"), c.parameter("leg_com"), c.parameter("leg_mass")
    stance = ca.vertcat(ca.sin(leg), ca.cos(leg))
    swing = ca.vertcat(ca.sin(between - leg), -ca.cos(between - leg))
    hip = c.foot + length * stance
    foot = hip + length * swing
    return assemble(
        "relative_compass",
        c,
        description="compass biped in relative coordinates",
        bodies=[
            PointMass(mass, c.foot + com * stance),
            PointMass(c.parameter("hip_mass"), hip),
            PointMass(mass, hip + (length - com) * swing),
        ],
        step=StepEnd(
            landing=foot,
            touchdown=between - 2 * leg,
            armed=leg,
            exchange=[leg - between, -between],
            upright=ca.cos(leg),
        ),
        actuators={"ankle": leg, "hip": between},
        drawing=Drawing(
            {"stance foot": c.foot, "hip": hip, "swing foot": foot}, [("stance foot", "hip"), ("hip", "swing foot")]
        ),
    )
