"""The vertical hopper: a body and a foot joined by a spring that is extended at its greatest compression."""

import functools

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import PointMass
from gaitopt.model.planar.joint_stop import JointStop, SwitchedSpring
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("body_mass", 8.0, "kg", "mass of the body", lower=0.0, lower_open=True),
    Parameter("foot_mass", 2.0, "kg", "mass of the foot", lower=0.0, lower_open=True),
    Parameter("stiffness", 4000.0, "N/m", "stiffness of the spring", lower=0.0, lower_open=True),
    Parameter("thrust", 0.02, "m", "increase of the rest length at the greatest compression", lower=0.0),
    Parameter(
        "leg_length", 0.5, "m", "full length of the leg, the rest length of the spring", lower=0.0, lower_open=True
    ),
    Parameter("gravity", 9.8, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def vertical_hopper() -> PlanarRobot:
    """Return the vertical hopper.

    The coordinates are the heights of body and foot.  A stop limits the leg to its full length; it is latched during
    flight.  The rest length increases by `thrust` at the greatest compression and returns at lift-off.
    Parameters: body_mass, foot_mass [kg], stiffness [N/m], thrust, leg_length [m], gravity [m/s^2].

    Examples
    --------
    >>> vertical_hopper().switches
    ('sole',)
    """
    c = PlanarCoordinates(("body", "foot"), PARAMETERS)
    body, foot, full = c.coordinate("body"), c.coordinate("foot"), c.parameter("leg_length")
    spring = SwitchedSpring(body - foot, c.parameter("stiffness"), full, c.parameter("thrust"), contact="sole")
    top, sole = ca.vertcat(0, body), ca.vertcat(0, foot)
    return assemble_planar(
        "vertical_hopper",
        c,
        bodies=[PointMass(c.parameter("body_mass"), top), PointMass(c.parameter("foot_mass"), sole)],
        contacts={
            "sole": PointContact(sole),
            "full length": JointStop(full - (body - foot), latched=True, released_by="sole closes"),
        },
        forces=[spring],
        drawing=Drawing({"body": top, "foot": sole}, [("body", "foot")]),
    )
