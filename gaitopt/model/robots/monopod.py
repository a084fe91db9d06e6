"""The monopod hopper: a body on a springy telescoping leg with a hip torque."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.forces import Spring
from gaitopt.model.mechanics import PointMass, RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("body_mass", 8.0, "kg", "mass of the body", lower=0.0, lower_open=True),
    Parameter("body_inertia", 0.4, "kg m^2", "inertia of the body about the hip", lower=0.0, lower_open=True),
    Parameter("foot_mass", 1.0, "kg", "mass of the foot", lower=0.0, lower_open=True),
    Parameter("stiffness", 3000.0, "N/m", "stiffness of the leg's spring", lower=0.0),
    Parameter("rest_length", 0.6, "m", "rest length of the leg's spring", lower=0.0, lower_open=True),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def monopod() -> PlanarRobot:
    """Return the planar monopod.

    Coordinates: hip (x, y), the angle phi of the body, the angle a of the leg from straight down, positive forward, and
    the length s of the leg.  A force in parallel with the spring works on s, a hip torque on a - phi.
    Parameters: body_mass, foot_mass [kg], body_inertia [kg m^2], stiffness [N/m], rest_length [m], gravity [m/s^2].

    Examples
    --------
    >>> monopod().actuators
    ('leg', 'hip')
    """
    c = PlanarCoordinates(("x", "y", "phi", "a", "s"), PARAMETERS)
    hip, angle, length = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("a"), c.coordinate("s")
    foot = hip + length * ca.vertcat(ca.sin(angle), -ca.cos(angle))
    return assemble_planar(
        "monopod",
        c,
        bodies=[
            RigidLink(c.parameter("body_mass"), hip, c.parameter("body_inertia"), -c.coordinate("phi")),
            PointMass(c.parameter("foot_mass"), foot),
        ],
        contacts={"foot": PointContact(foot), "hip point": PointContact(hip, falls=True)},
        actuators={"leg": length, "hip": angle - c.coordinate("phi")},
        forces=[Spring(length, c.parameter("stiffness"), c.parameter("rest_length"))],
        drawing=Drawing({"hip": hip, "foot": foot}, [("hip", "foot")]),
    )
