"""Small planar robots for tests, written as a user would write them."""

import casadi as ca

from gaitopt.model import PointContact, PointMass, RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.parameters import Parameter

GRAVITY = Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0)


def box(half_width=0.1, half_height=0.3, mass=1.0):
    """A uniform box on two corners; angle clockwise."""
    c = PlanarCoordinates(("x", "y", "angle"), [GRAVITY])
    centre, angle = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("angle")
    turned = ca.vertcat(ca.cos(angle), -ca.sin(angle)), ca.vertcat(ca.sin(angle), ca.cos(angle))
    corners = {
        name: centre + side * half_width * turned[0] - half_height * turned[1]
        for name, side in (("rear", -1), ("front", 1))
    }
    return assemble_planar(
        "box",
        c,
        bodies=[RigidLink(mass, centre, mass * (half_width**2 + half_height**2) / 3, angle)],
        contacts={name: PointContact(corner, body="box") for name, corner in corners.items()},
    )


def rod():
    """A uniform rod of half-length 1 and mass 1 that touches the ground with its lower end.

    The angle is between the rod and the ground, its centre above and to the left of the tip for angles below pi / 2.
    """
    c = PlanarCoordinates(("x", "y", "angle"), [Parameter("gravity", 1.0, "m/s^2", "gravity", lower=0.0)])
    centre, angle = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("angle")
    tip = centre + ca.vertcat(ca.cos(angle), -ca.sin(angle))
    return assemble_planar("rod", c, bodies=[RigidLink(1.0, centre, 1 / 3, angle)], contacts={"tip": PointContact(tip)})


def heel_toe_walker():
    """Two straight legs with flat feet, each with a heel and a toe."""
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts = [PointMass(10.0, hip)], {"hip": PointContact(hip, falls=True)}
    for leg, other in ("ab", "ba"):
        angle = c.coordinate(leg)
        down, ahead = ca.vertcat(ca.sin(angle), -ca.cos(angle)), ca.vertcat(ca.cos(angle), ca.sin(angle))
        bodies.append(RigidLink(2.0, hip + 0.4 * down, 0.1, -angle))
        armed = angle - c.coordinate(other) - 0.05
        for name, distance in (("heel", -0.04), ("toe", 0.08)):
            contacts[f"{name} {leg}"] = PointContact(hip + down + distance * ahead, body=f"foot {leg}", armed=armed)
    mirror = {"a": "b", "heel a": "heel b", "toe a": "toe b"}
    return assemble_planar("heel-toe walker", c, bodies=bodies, contacts=contacts, mirror=mirror)
