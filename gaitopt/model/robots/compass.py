"""The compass biped: two straight legs, a hip, point feet, ankle and hip torque."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing, StepEnd, assemble
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import PointMass
from gaitopt.model.robot import Coordinates, Robot
from gaitopt.model.step_check import exempt_from_step_check
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("leg_length", 1.6, "m", "length of a leg", lower=0.0, lower_open=True),
    Parameter("leg_com", 0.8, "m", "distance of the leg's mass from its foot", lower=0.0, at_most="leg_length"),
    Parameter("leg_mass", 4.0, "kg", "mass of a leg", lower=0.0, lower_open=True),
    Parameter("hip_mass", 2.0, "kg", "mass at the hip", lower=0.0),
    Parameter("gravity", 9.8, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def compass_biped() -> Robot:
    """Return the compass biped of Goswami et al. and Gamus & Or.

    hip = foot + l (sin th1, cos th1); swing foot = hip + l (sin th2, -cos th2): for th1 > 0 the stance leg is
    inclined forward, for th2 > 0 the swing foot is ahead of the hip.  The ankle torque works on th1, the hip torque on
    th1 + th2.
    Parameters: leg_length [m], leg_com [m], leg_mass [kg], hip_mass [kg], gravity [m/s^2]; ground: slope [rad],
    friction [1].

    The step ends when th2 - th1 falls through zero with th1 > 0.  There are no knees, so the scuffing crossings
    (the start of a step, th2 - th1 rising in mid-swing, and th2 = -th1) are ignored, as in the literature.

    Returns
    -------
    Robot
        The same object at every call, so that its Functions are compiled once.

    Examples
    --------
    >>> compass_biped().actuators
    ('ankle', 'hip')
    """
    c = Coordinates(("th1", "th2"), PARAMETERS)
    th1, th2 = c.angle("th1"), c.angle("th2")
    length, com = c.parameter("leg_length"), c.parameter("leg_com")
    leg_mass, hip_mass = c.parameter("leg_mass"), c.parameter("hip_mass")
    stance = ca.vertcat(ca.sin(th1), ca.cos(th1))
    swing = ca.vertcat(ca.sin(th2), -ca.cos(th2))
    hip = c.foot + length * stance
    swing_foot = hip + length * swing
    robot = assemble(
        "compass_biped",
        c,
        description="compass biped with point feet, ankle and hip torque",
        bodies=[
            PointMass(leg_mass, c.foot + com * stance),
            PointMass(hip_mass, hip),
            PointMass(leg_mass, hip + (length - com) * swing),
        ],
        step=StepEnd(
            landing=PointContact(swing_foot),
            touchdown=th2 - th1,
            armed=th1,
            exchange=[-th2, -th1],
            upright=ca.cos(th1),
        ),
        actuators={"ankle": th1, "hip": th1 + th2},
        drawing=Drawing(
            {"stance foot": c.foot, "hip": hip, "swing foot": swing_foot},
            [("stance foot", "hip"), ("hip", "swing foot")],
        ),
    )
    return exempt_from_step_check(robot)
