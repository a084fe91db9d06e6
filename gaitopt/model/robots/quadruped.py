"""The quadruped: a body on two pairs of telescoping legs with springs and hip torques."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.forces import Force, Spring
from gaitopt.model.mechanics import Body, PointMass, RigidLink
from gaitopt.model.planar.planar_assembly import AnyContact, assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("body_mass", 20.0, "kg", "mass of the body", lower=0.0, lower_open=True),
    Parameter("body_inertia", 1.0, "kg m^2", "inertia of the body about its middle", lower=0.0, lower_open=True),
    Parameter("body_length", 0.6, "m", "distance between the hips", lower=0.0, lower_open=True),
    Parameter("foot_mass", 0.5, "kg", "mass of a pair of feet", lower=0.0, lower_open=True),
    Parameter("stiffness", 5000.0, "N/m", "stiffness of the springs of a pair of legs", lower=0.0),
    Parameter("rest_length", 0.4, "m", "rest length of the springs", lower=0.0, lower_open=True),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def quadruped() -> PlanarRobot:
    """Return the planar quadruped whose back and front legs move in pairs.

    Coordinates: middle of the body (x, y), its pitch, positive with the front raised, and for each pair of legs the
    angle from straight down, positive forward, and the length.  A force in parallel with the spring works on each
    length, a torque on the angle between leg and body.
    Parameters: body_mass, foot_mass [kg], body_inertia [kg m^2], body_length, rest_length [m], stiffness [N/m], gravity
    [m/s^2].

    Examples
    --------
    >>> quadruped().actuators
    ('back leg', 'back hip', 'front leg', 'front hip')
    """
    pairs = {"back": -0.5, "front": 0.5}
    names = [f"{pair}_{part}" for pair in pairs for part in ("angle", "length")]
    c = PlanarCoordinates(("x", "y", "pitch", *names), PARAMETERS)
    middle, pitch = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("pitch")
    bodies: list[Body] = [RigidLink(c.parameter("body_mass"), middle, c.parameter("body_inertia"), -pitch)]
    contacts, actuators, points = dict[str, AnyContact](), dict[str, ca.SX](), dict[str, ca.SX]()
    forces: list[Force] = []
    for pair, place in pairs.items():
        angle, length = c.coordinate(f"{pair}_angle"), c.coordinate(f"{pair}_length")
        hip = middle + place * c.parameter("body_length") * ca.vertcat(ca.cos(pitch), ca.sin(pitch))
        foot = hip + length * ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(PointMass(c.parameter("foot_mass"), foot))
        contacts |= {f"{pair} foot": PointContact(foot), f"{pair} hip point": PointContact(hip, falls=True)}
        actuators |= {f"{pair} leg": length, f"{pair} hip": angle - pitch}
        forces.append(Spring(length, c.parameter("stiffness"), c.parameter("rest_length")))
        points |= {f"{pair} hip point": hip, f"{pair} foot": foot}
    links = [("back hip point", "front hip point"), *((f"{pair} hip point", f"{pair} foot") for pair in pairs)]
    return assemble_planar(
        "quadruped",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators=actuators,
        forces=forces,
        drawing=Drawing(points, links),
    )
