"""The compass biped with a torso: two straight legs and a torso that is balanced by torques at the hip."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import PointMass
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("torso_mass", 10.0, "kg", "mass of the torso", lower=0.0, lower_open=True),
    Parameter("torso_length", 0.5, "m", "distance of the torso's mass from the hip", lower=0.0, lower_open=True),
    Parameter("hip_mass", 15.0, "kg", "mass at the hip", lower=0.0),
    Parameter("leg_mass", 5.0, "kg", "mass of a leg", lower=0.0, lower_open=True),
    Parameter("leg_length", 1.0, "m", "length of a leg", lower=0.0, lower_open=True),
    Parameter("leg_com", 0.5, "m", "distance of a leg's mass from its foot", lower=0.0, at_most="leg_length"),
    Parameter("clearance_angle", 1e-3, "rad", "least angle between the legs at which a foot can land", lower=0.0),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def compass_with_torso() -> PlanarRobot:
    """Return the walker of Grizzle, Abba & Plestan (IEEE Transactions on Automatic Control 46, 2001).

    Coordinates: hip (x, y), the angle of the torso from straight up, positive forward, and the angles a and b of the
    legs from straight down, positive forward.  A torque acts between the torso and each leg, none at the feet.  A foot
    passes through the ground in mid-swing and lands only if its leg is the front one.
    Parameters: torso_mass, hip_mass, leg_mass [kg], torso_length, leg_length, leg_com [m], clearance_angle [rad],
    gravity [m/s^2].

    Examples
    --------
    >>> compass_with_torso().actuators
    ('hip A', 'hip B')
    """
    c = PlanarCoordinates(("x", "y", "torso", "a", "b"), PARAMETERS)
    hip, torso = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("torso")
    head = hip + c.parameter("torso_length") * ca.vertcat(ca.sin(torso), ca.cos(torso))
    bodies = [PointMass(c.parameter("hip_mass"), hip), PointMass(c.parameter("torso_mass"), head)]
    contacts, actuators, feet = {}, {}, {}
    for leg, other in (("a", "b"), ("b", "a")):
        angle, label = c.coordinate(leg), leg.upper()
        down = ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(
            PointMass(c.parameter("leg_mass"), hip + (c.parameter("leg_length") - c.parameter("leg_com")) * down)
        )
        feet[f"foot {label}"] = hip + c.parameter("leg_length") * down
        armed = angle - c.coordinate(other) - c.parameter("clearance_angle")
        contacts[f"foot {label}"] = PointContact(feet[f"foot {label}"], armed=armed)
        actuators[f"hip {label}"] = angle + torso
    return assemble_planar(
        "compass_with_torso",
        c,
        bodies=bodies,
        contacts={**contacts, "hip point": PointContact(hip, falls=True)},
        actuators=actuators,
        mirror={"a": "b", "foot A": "foot B", "hip A": "hip B"},
        drawing=Drawing({"hip": hip, "head": head, **feet}, [("hip", "head"), ("hip", "foot A"), ("hip", "foot B")]),
    )
