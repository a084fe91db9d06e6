"""The compass biped with a spring, a damper and a geared rotor at its hip."""

import functools

import casadi as ca

from gaitopt import Coordinates, Drawing, Parameter, PointMass, StepEnd, assemble
from gaitopt.model import Damper, Potential, RotorInertia, Spring
from gaitopt.model.robots.compass import PARAMETERS

STIFFNESS = Parameter("hip_stiffness", 3.0, "N m/rad", "stiffness of the hip spring", lower=0.0)
DAMPING = Parameter("hip_damping", 0.1, "N m s/rad", "damping of the hip", lower=0.0)
ROTOR = Parameter("rotor_inertia", 1e-4, "kg m^2", "inertia of the rotor at the hip", lower=0.0)
RATIO = Parameter("gear_ratio", 50.0, "1", "gear ratio at the hip", lower=0.0)

MAKERS = {
    "spring": (STIFFNESS, lambda c, s, rest: Spring(s, c.parameter("hip_stiffness"), rest)),
    "potential": (STIFFNESS, lambda c, s, _: Potential(c.parameter("hip_stiffness") * (1 - ca.cos(s)))),
    "hardening": (STIFFNESS, lambda c, s, _: Potential(c.parameter("hip_stiffness") * (s**2 / 2 + 4 * s**4))),
    "stop": (
        STIFFNESS,
        lambda c, s, _: Potential(c.parameter("hip_stiffness") * ca.fmax(0, ca.fabs(s) - 0.2) ** 2 / 2),
    ),
    "damper": (DAMPING, lambda c, s, _: Damper(s, c.parameter("hip_damping"))),
    "rotor": (ROTOR, lambda c, s, _: RotorInertia(s, c.parameter("rotor_inertia"), c.parameter("gear_ratio"))),
}


@functools.cache
def sprung_compass(*names, rest=0.0):
    """Return the compass biped with forces on its hip angle th1 + th2: spring, potential, hardening,
    stop, damper or rotor.

    The exchange of the legs changes the sign of the hip angle, so a spring with another rest angle than 0 is at odds
    with it.
    """
    added = [MAKERS[name][0] for name in names] + ([RATIO] if "rotor" in names else [])
    c = Coordinates(("th1", "th2"), (*PARAMETERS, *added))
    th1, th2 = c.angle("th1"), c.angle("th2")
    length, com = c.parameter("leg_length"), c.parameter("leg_com")
    stance, swing = ca.vertcat(ca.sin(th1), ca.cos(th1)), ca.vertcat(ca.sin(th2), -ca.cos(th2))
    hip = c.foot + length * stance
    swing_foot = hip + length * swing
    return assemble(
        "_".join(["compass", *names]),
        c,
        bodies=[
            PointMass(c.parameter("leg_mass"), c.foot + com * stance),
            PointMass(c.parameter("hip_mass"), hip),
            PointMass(c.parameter("leg_mass"), hip + (length - com) * swing),
        ],
        step=StepEnd(landing=swing_foot, touchdown=th2 - th1, armed=th1, exchange=[-th2, -th1], upright=ca.cos(th1)),
        actuators={"ankle": th1, "hip": th1 + th2},
        drawing=Drawing(
            {"stance foot": c.foot, "hip": hip, "swing foot": swing_foot},
            [("stance foot", "hip"), ("hip", "swing foot")],
        ),
        forces=[MAKERS[name][1](c, th1 + th2, rest) for name in names],
    )
