"""The kneed walker: thighs and shanks with knees that latch when they are straight."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import PointMass
from gaitopt.model.planar.joint_stop import JointStop
from gaitopt.model.planar.planar_assembly import AnyContact, assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("hip_mass", 0.5, "kg", "mass at the hip", lower=0.0),
    Parameter("thigh_mass", 0.5, "kg", "mass of a thigh", lower=0.0, lower_open=True),
    Parameter("shank_mass", 0.05, "kg", "mass of a shank", lower=0.0, lower_open=True),
    Parameter("thigh_length", 0.5, "m", "length of a thigh", lower=0.0, lower_open=True),
    Parameter("shank_length", 0.5, "m", "length of a shank", lower=0.0, lower_open=True),
    Parameter("thigh_com", 0.325, "m", "distance of the thigh's mass from the hip", lower=0.0, at_most="thigh_length"),
    Parameter("shank_com", 0.125, "m", "distance of the shank's mass from the knee", lower=0.0, at_most="shank_length"),
    Parameter("clearance_angle", 1e-3, "rad", "least angle between the legs at which a foot can land", lower=0.0),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def kneed_walker() -> PlanarRobot:
    """Return the kneed walker with point masses and point feet.

    Coordinates: hip (x, y), the angles a and b of the thighs from straight down, positive forward, and the flexions of
    the knees, zero if straight.  A knee latches when it is straight and is released when its foot leaves the ground.
    Torques act at the hip, on a - b, and on the flexions; without them the walker is passive.
    Parameters: hip_mass, thigh_mass, shank_mass [kg], thigh_length, shank_length, thigh_com, shank_com [m],
    clearance_angle [rad], gravity [m/s^2].

    Examples
    --------
    >>> kneed_walker().coordinates
    ('x', 'y', 'a', 'flexion_a', 'b', 'flexion_b')
    """
    c = PlanarCoordinates(("x", "y", "a", "flexion_a", "b", "flexion_b"), PARAMETERS)
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies = [PointMass(c.parameter("hip_mass"), hip)]
    contacts: dict[str, AnyContact] = {"hip point": PointContact(hip, falls=True)}
    points, links = {"hip": hip}, list[tuple[str, str]]()
    for leg, other in (("a", "b"), ("b", "a")):
        angle, flexion, label = c.coordinate(leg), c.coordinate(f"flexion_{leg}"), leg.upper()
        thigh = ca.vertcat(ca.sin(angle), -ca.cos(angle))
        shank = ca.vertcat(ca.sin(angle - flexion), -ca.cos(angle - flexion))
        knee = hip + c.parameter("thigh_length") * thigh
        foot = knee + c.parameter("shank_length") * shank
        bodies.append(PointMass(c.parameter("thigh_mass"), hip + c.parameter("thigh_com") * thigh))
        bodies.append(PointMass(c.parameter("shank_mass"), knee + c.parameter("shank_com") * shank))
        armed = angle - c.coordinate(other) - c.parameter("clearance_angle")
        contacts[f"foot {label}"] = PointContact(foot, armed=armed)
        contacts[f"knee {label}"] = JointStop(flexion, latched=True, released_by=f"foot {label} opens")
        points |= {f"knee point {label}": knee, f"foot point {label}": foot}
        links += [("hip", f"knee point {label}"), (f"knee point {label}", f"foot point {label}")]
    return assemble_planar(
        "kneed_walker",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={
            "hip": c.coordinate("a") - c.coordinate("b"),
            "knee A": c.coordinate("flexion_a"),
            "knee B": c.coordinate("flexion_b"),
        },
        mirror={"a": "b", "flexion_a": "flexion_b", "foot A": "foot B", "knee A": "knee B", "hip": "-hip"},
        drawing=Drawing(points, links),
    )
