"""The telescoping biped: a point mass on two legs that extend and shorten, for walking and running."""

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
    Parameter("body_mass", 1.0, "kg", "mass of the body", lower=0.0, lower_open=True),
    Parameter("foot_mass", 0.005, "kg", "mass of a foot", lower=0.0, lower_open=True),
    Parameter("gravity", 1.0, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def telescoping_biped() -> PlanarRobot:
    """Return the biped of Srinivasan & Ruina (Nature 439, 2006) with light feet, which walks and runs.

    Coordinates: hip (x, y), the angles a and b of the legs from straight down, positive forward, and their lengths
    length_a and length_b.  A force works on each length, a hip torque on a - b.  The feet have mass, because the swing
    of massless legs is not defined; the limit of massless legs has closed forms.
    Parameters: body_mass, foot_mass [kg], gravity [m/s^2].

    Examples
    --------
    >>> telescoping_biped().actuators
    ('leg A', 'leg B', 'hip')
    """
    c = PlanarCoordinates(("x", "y", "a", "length_a", "b", "length_b"), PARAMETERS)
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, feet, contacts = [PointMass(c.parameter("body_mass"), hip)], {}, {}
    for leg in "ab":
        angle, length, label = c.coordinate(leg), c.coordinate(f"length_{leg}"), f"foot {leg.upper()}"
        feet[label] = hip + length * ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(PointMass(c.parameter("foot_mass"), feet[label]))
        contacts[label] = PointContact(feet[label])
    lengths = {"leg A": c.coordinate("length_a"), "leg B": c.coordinate("length_b")}
    return assemble_planar(
        "telescoping_biped",
        c,
        bodies=bodies,
        contacts={**contacts, "hip point": PointContact(hip, falls=True)},
        actuators={**lengths, "hip": c.coordinate("a") - c.coordinate("b")},
        mirror={"a": "b", "length_a": "length_b", "foot A": "foot B", "leg A": "leg B", "hip": "-hip"},
        drawing=Drawing({"hip": hip, **feet}, [("hip", "foot A"), ("hip", "foot B")]),
    )
