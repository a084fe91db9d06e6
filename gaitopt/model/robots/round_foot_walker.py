"""The walker with round feet: two straight legs whose circular feet roll on the ground."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import ArcContact, PointContact
from gaitopt.model.mechanics import Body, PointMass, RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("hip_mass", 1.0, "kg", "mass at the hip", lower=0.0),
    Parameter("leg_mass", 0.5, "kg", "mass of a leg", lower=0.0, lower_open=True),
    Parameter("leg_inertia", 0.02, "kg m^2", "inertia of a leg about its centre of mass", lower=0.0),
    Parameter(
        "leg_length", 1.0, "m", "distance of the centre of the foot's arc from the hip", lower=0.0, lower_open=True
    ),
    Parameter("leg_com", 0.5, "m", "distance of the leg's centre of mass from the hip", lower=0.0),
    Parameter("foot_radius", 0.2, "m", "radius of a foot", lower=0.0),
    Parameter("clearance_angle", 1e-3, "rad", "least angle between the legs at which a foot can land", lower=0.0),
    Parameter("gravity", 1.0, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def round_foot_walker() -> PlanarRobot:
    """Return the passive walker with round feet and straight legs.

    Coordinates: hip (x, y), and the angles of legs A and B from straight down, positive forward.  A foot passes through
    the ground in mid-swing and lands only when its leg is the front one.
    Parameters: hip_mass, leg_mass [kg], leg_inertia [kg m^2], leg_length, leg_com, foot_radius [m], clearance_angle
    [rad], gravity [m/s^2].

    Examples
    --------
    >>> round_foot_walker().contact_names
    ('foot A', 'foot B', 'hip point')
    """
    c = PlanarCoordinates(("x", "y", "a", "b"), PARAMETERS)
    hip, radius = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.parameter("foot_radius")
    bodies: list[Body] = [PointMass(c.parameter("hip_mass"), hip)]
    centres, contacts = {}, {}
    for name, other in (("a", "b"), ("b", "a")):
        angle = c.coordinate(name)
        along = ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(
            RigidLink(c.parameter("leg_mass"), hip + c.parameter("leg_com") * along, c.parameter("leg_inertia"), -angle)
        )
        centre = hip + c.parameter("leg_length") * along
        armed = angle - c.coordinate(other) - c.parameter("clearance_angle")
        centres[f"centre {name.upper()}"] = centre
        contacts[f"foot {name.upper()}"] = ArcContact(centre, radius, -angle, armed=armed)
    return assemble_planar(
        "round_foot_walker",
        c,
        bodies=bodies,
        contacts={**contacts, "hip point": PointContact(hip, falls=True)},
        mirror={"a": "b", "foot A": "foot B"},
        drawing=Drawing({"hip": hip, **centres}, [("hip", "centre A"), ("hip", "centre B")]),
    )
