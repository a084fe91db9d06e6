"""The rimless wheel as a free body whose spokes are contacts."""

import functools
import math

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("leg_length", 1.0, "m", "length of a spoke", lower=0.0, lower_open=True),
    Parameter("mass", 1.0, "kg", "mass of the wheel", lower=0.0, lower_open=True),
    Parameter("inertia_ratio", 1 / 3, "1", "I_c / (m l^2)", lower=0.0, lower_open=True),
    Parameter("gravity", 9.8, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)

SPOKES = Parameter("The number of spokes", 10, "1", "", lower=3, upper=360, whole=True)


@check_arguments
@functools.cache
@one_at_a_time
def spoked_wheel(spokes: int = 10) -> PlanarRobot:
    """Return the rimless wheel with every spoke as a contact of one body.

    Coordinates: centre (x, y), and the clockwise angle theta of spoke 0 from straight down.  Spoke k follows spoke
    k - 1 when the wheel rolls forward.  Two spokes on the ground stick or slip together.
    Parameters: leg_length l [m], mass [kg], inertia_ratio I_c/(m l^2), gravity [m/s^2].

    Parameters
    ----------
    spokes : int
        Number of spokes, 3 to 360.

    Examples
    --------
    >>> spoked_wheel(6).contact_names
    ('spoke 0', 'spoke 1', 'spoke 2', 'spoke 3', 'spoke 4', 'spoke 5')
    """
    SPOKES.check(spokes)
    c = PlanarCoordinates(("x", "y", "theta"), PARAMETERS)
    centre, theta, length = (
        ca.vertcat(c.coordinate("x"), c.coordinate("y")),
        c.coordinate("theta"),
        c.parameter("leg_length"),
    )
    tips = {}
    for k in range(spokes):
        angle = theta - 2 * math.pi * k / spokes
        tips[f"spoke {k}"] = centre - length * ca.vertcat(ca.sin(angle), ca.cos(angle))
    inertia = c.parameter("inertia_ratio") * c.parameter("mass") * length**2
    return assemble_planar(
        f"spoked_wheel_{spokes}",
        c,
        bodies=[RigidLink(c.parameter("mass"), centre, inertia, theta)],
        contacts={name: PointContact(tip, body="wheel") for name, tip in tips.items()},
        drawing=Drawing({"centre": centre, **tips}, [("centre", name) for name in tips]),
    )
