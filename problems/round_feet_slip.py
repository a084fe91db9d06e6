"""Energy-optimal gait of a compass biped whose round feet roll and, at touchdown, slip: an example of arc contacts.

The legs are straight and end in circular arcs centred on the leg, as in McGeer's passive walkers (International Journal
of Robotics Research 9(2), 1990).  With ``foot_radius=0`` and ``leg_inertia=0`` the robot is the compass biped.

Run it with ``gaitopt solve problems/round_feet_slip.py``; change any keyword below with ``--set NAME=VALUE``.
"""

import functools
import math

import casadi as ca

from gaitopt import (
    ArcContact,
    Coordinates,
    Drawing,
    GaitProblem,
    Limits,
    Parameter,
    PointMass,
    RigidLink,
    Robot,
    StepEnd,
    assemble,
)
from gaitopt.ocp import transcription_named

PARAMETERS = (
    Parameter("leg_length", 1.0, "m", "distance from the hip to the middle of the foot", lower=0, lower_open=True),
    Parameter("foot_radius", 0.3, "m", "radius of the feet", lower=0, at_most="leg_length"),
    Parameter("leg_com", 0.65, "m", "distance of the leg's mass from its foot", lower=0, at_most="leg_length"),
    Parameter("leg_mass", 5.0, "kg", "mass of a leg", lower=0, lower_open=True),
    Parameter("leg_inertia", 0.0, "kg m^2", "moment of inertia of a leg about its centre of mass", lower=0),
    Parameter("hip_mass", 10.0, "kg", "mass at the hip", lower=0),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0, lower_open=True),
)


@functools.cache
def round_feet_biped() -> Robot:
    """Return the biped; its angles are those of the compass biped, th1 of the stance leg and th2 of the swing leg."""
    c = Coordinates(("th1", "th2"), PARAMETERS)
    th1, th2 = c.angle("th1"), c.angle("th2")
    length, radius, com = c.parameter("leg_length"), c.parameter("foot_radius"), c.parameter("leg_com")
    mass, inertia = c.parameter("leg_mass"), c.parameter("leg_inertia")

    foot = ArcContact.on(c.foot, radius, th1)
    up, down = ca.vertcat(ca.sin(th1), ca.cos(th1)), ca.vertcat(ca.sin(th2), -ca.cos(th2))
    hip = foot.centre + (length - radius) * up
    landing = ArcContact(hip + (length - radius) * down, radius, -th2)  # th2 is counter-clockwise
    return assemble(
        "round_feet_biped",
        c,
        description="compass biped with round feet, ankle and hip torque",
        bodies=[
            RigidLink(mass, hip - (length - com) * up, inertia, th1),
            PointMass(c.parameter("hip_mass"), hip),
            RigidLink(mass, hip + (length - com) * down, inertia, -th2),
        ],
        step=StepEnd(
            landing=landing,
            touchdown=th2 - th1,
            armed=th1,
            exchange=[-th2, -th1],
            upright=ca.cos(th1),
        ),
        actuators={"ankle": th1, "hip": th1 + th2},
        drawing=Drawing(
            {"stance foot": hip - length * up, "hip": hip, "swing foot": hip + length * down},
            [("stance foot", "hip"), ("hip", "swing foot")],
            stance=foot,
        ),
    )


def problem(
    leg_length=1.0,  # from the hip to the middle of the foot [m]
    foot_radius=0.3,  # [m]
    leg_com=0.65,  # distance of a leg's mass from its foot [m]
    leg_mass=5.0,  # [kg]
    leg_inertia=0.0,  # of a leg about its centre of mass [kg m^2]
    hip_mass=10.0,  # [kg]
    gravity=9.81,  # [m/s^2]
    slope=0.0,  # downhill [deg]
    friction=0.06,  # Coulomb coefficient
    speed=0.9,  # [m/s]
    step_length=0.5,  # travel per step, foot slip included [m]
    torque_limit=30.0,  # of ankle and hip each [N m]
    objective="torque_squared",  # or cost_of_transport, positive_work, ...
    intervals=40,  # grid intervals of a sticking phase (a slip phase has a quarter)
    sequence="slip+ stick | slip+",  # contact sequence: phases | impact; stick means rolling without slip
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem: minimise the objective at a given speed and step length."""
    return GaitProblem(
        name="round feet, slipping impact",
        robot=round_feet_biped(),
        sequence=sequence,
        parameters={
            "leg_length": leg_length,
            "foot_radius": foot_radius,
            "leg_com": leg_com,
            "leg_mass": leg_mass,
            "leg_inertia": leg_inertia,
            "hip_mass": hip_mass,
            "gravity": gravity,
        },
        slope=math.radians(slope),
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective=objective,
        transcription=transcription_named(transcription)(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
