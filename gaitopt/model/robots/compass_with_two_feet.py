"""The compass biped in the coordinates of its hip, with both feet as contacts."""

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
from gaitopt.model.robots.compass import PARAMETERS as COMPASS
from gaitopt.parameters import Parameter

PARAMETERS = (
    *COMPASS,
    Parameter("clearance_angle", 1e-3, "rad", "least angle between the legs at which a foot can land", lower=0.0),
)


@check_arguments
@functools.cache
@one_at_a_time
def compass_with_two_feet() -> PlanarRobot:
    """Return the compass biped with both feet as contacts, for double support and flight.

    Coordinates: hip (x, y), and the angles of legs A and B from straight down, positive forward.  A foot passes through
    the ground in mid-swing and lands only when its leg is the front one.  The ankle torques work on a and b, the hip
    torque on a - b.
    Parameters: those of :func:`gaitopt.compass_biped`, and clearance_angle [rad].

    Examples
    --------
    >>> compass_with_two_feet().contact_names
    ('foot A', 'foot B', 'hip point')
    """
    c = PlanarCoordinates(("x", "y", "a", "b"), PARAMETERS)
    hip, length = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.parameter("leg_length")
    bodies, contacts, feet = [PointMass(c.parameter("hip_mass"), hip)], {}, {}
    for name, other in (("a", "b"), ("b", "a")):
        angle, label = c.coordinate(name), f"foot {name.upper()}"
        along = ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(PointMass(c.parameter("leg_mass"), hip + (length - c.parameter("leg_com")) * along))
        armed = angle - c.coordinate(other) - c.parameter("clearance_angle")
        feet[label] = hip + length * along
        contacts[label] = PointContact(feet[label], armed=armed)
    return assemble_planar(
        "compass_with_two_feet",
        c,
        bodies=bodies,
        contacts={**contacts, "hip point": PointContact(hip, falls=True)},
        actuators={
            "ankle A": c.coordinate("a"),
            "ankle B": c.coordinate("b"),
            "hip": c.coordinate("a") - c.coordinate("b"),
        },
        mirror={"a": "b", "foot A": "foot B", "ankle A": "ankle B", "hip": "-hip"},
        drawing=Drawing({"hip": hip, **feet}, [("hip", "foot A"), ("hip", "foot B")]),
    )
