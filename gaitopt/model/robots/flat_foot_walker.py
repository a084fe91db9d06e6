"""The flat-foot walker: straight legs whose feet touch the ground with heel and toe."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import Body, PointMass, RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("hip_mass", 10.0, "kg", "mass at the hip", lower=0.0),
    Parameter("leg_mass", 4.0, "kg", "mass of a leg", lower=0.0, lower_open=True),
    Parameter("leg_inertia", 0.2, "kg m^2", "inertia of a leg about its centre of mass", lower=0.0),
    Parameter("leg_length", 0.9, "m", "distance of the ankle from the hip", lower=0.0, lower_open=True),
    Parameter(
        "leg_com", 0.4, "m", "distance of the leg's centre of mass from the hip", lower=0.0, at_most="leg_length"
    ),
    Parameter("foot_mass", 1.0, "kg", "mass of a foot", lower=0.0, lower_open=True),
    Parameter("foot_inertia", 0.005, "kg m^2", "inertia of a foot about its middle", lower=0.0, lower_open=True),
    Parameter("ankle_height", 0.08, "m", "height of the ankle above the sole", lower=0.0),
    Parameter("heel_length", 0.06, "m", "distance of the heel behind the ankle", lower=0.0),
    Parameter("toe_length", 0.16, "m", "distance of the toe ahead of the ankle", lower=0.0, lower_open=True),
    Parameter("clearance_angle", 1e-3, "rad", "least angle between the legs at which a foot can land", lower=0.0),
    Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def flat_foot_walker() -> PlanarRobot:
    """Return the walker with flat feet; heel and toe of a foot stick or slip together.

    Coordinates: hip (x, y), the angles a and b of the legs from straight down, positive forward, and the angles ankle_a
    and ankle_b by which the toes are raised from the right angle with the leg.  A foot passes through the ground in
    mid-swing and lands only if its leg is the front one.  Torques act on the ankles and, on a - b, at the hip.
    Parameters: hip_mass, leg_mass, foot_mass [kg], leg_inertia, foot_inertia [kg m^2], leg_length, leg_com,
    ankle_height, heel_length, toe_length [m], clearance_angle [rad], gravity [m/s^2].

    Examples
    --------
    >>> flat_foot_walker().contact_names
    ('heel A', 'toe A', 'heel B', 'toe B', 'hip point')
    """
    c = PlanarCoordinates(("x", "y", "a", "ankle_a", "b", "ankle_b"), PARAMETERS)
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies: list[Body] = [PointMass(c.parameter("hip_mass"), hip)]
    contacts, actuators, points = {}, {}, {"hip": hip}
    for leg, other in (("a", "b"), ("b", "a")):
        angle, label = c.coordinate(leg), leg.upper()
        pitch = angle + c.coordinate(f"ankle_{leg}")
        down, ahead = ca.vertcat(ca.sin(angle), -ca.cos(angle)), ca.vertcat(ca.cos(pitch), ca.sin(pitch))
        ankle = hip + c.parameter("leg_length") * down
        sole = ankle + c.parameter("ankle_height") * ca.vertcat(ca.sin(pitch), -ca.cos(pitch))
        heel, toe = sole - c.parameter("heel_length") * ahead, sole + c.parameter("toe_length") * ahead
        com = hip + c.parameter("leg_com") * down
        bodies.append(RigidLink(c.parameter("leg_mass"), com, c.parameter("leg_inertia"), -angle))
        bodies.append(
            RigidLink(c.parameter("foot_mass"), (ankle + heel + toe) / 3, c.parameter("foot_inertia"), -pitch)
        )
        armed = angle - c.coordinate(other) - c.parameter("clearance_angle")
        for name, point in ((f"heel {label}", heel), (f"toe {label}", toe)):
            contacts[name] = PointContact(point, body=f"foot {label}", armed=armed)
            points[name] = point
        points[f"ankle point {label}"] = ankle
        actuators[f"ankle {label}"] = c.coordinate(f"ankle_{leg}")
    sides = [(f"ankle point {label}", f"{end} {label}") for label in "AB" for end in ("heel", "toe")]
    links = [("hip", "ankle point A"), ("hip", "ankle point B"), *sides, ("heel A", "toe A"), ("heel B", "toe B")]
    pairs = {"a": "b", "ankle_a": "ankle_b", "heel A": "heel B", "toe A": "toe B", "ankle A": "ankle B"}
    return assemble_planar(
        "flat_foot_walker",
        c,
        bodies=bodies,
        contacts={**contacts, "hip point": PointContact(hip, falls=True)},
        actuators={**actuators, "hip": c.coordinate("a") - c.coordinate("b")},
        mirror={**pairs, "hip": "-hip"},
        drawing=Drawing(points, links),
    )
