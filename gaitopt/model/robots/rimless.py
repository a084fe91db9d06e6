"""The rimless wheel: one rigid body on evenly spaced spokes."""

import functools
import math

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing, StepEnd, assemble
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.mechanics import RigidLink
from gaitopt.model.robot import Coordinates, Robot
from gaitopt.model.step_check import exempt_from_step_check
from gaitopt.parameters import Parameter

PARAMETERS = (
    Parameter("spokes", 10.0, "1", "number of spokes", lower=3.0, whole=True),
    Parameter("leg_length", 1.0, "m", "length of a spoke", lower=0.0, lower_open=True),
    Parameter("mass", 1.0, "kg", "mass of the wheel", lower=0.0, lower_open=True),
    Parameter("inertia_ratio", 1 / 3, "1", "I_c / (m l^2)", lower=0.0, lower_open=True),
    Parameter("gravity", 9.8, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True),
)


@check_arguments
@functools.cache
@one_at_a_time
def rimless_wheel() -> Robot:
    """Return the rimless wheel of McGeer, with the parameters of Gamus & Or.

    The centre is at foot + l (sin theta, cos theta); theta runs from -pi/n to +pi/n, where the next spoke lands.
    A point mass on massless spokes is a singular limit, because its foot has no inertia; inertia_ratio 1e-6 is close.
    Parameters: spokes n, leg_length l [m], mass [kg], inertia_ratio I_c/(m l^2), gravity [m/s^2]; ground: slope
    [rad], friction [1].  There are no actuators.

    Returns
    -------
    Robot
        The same object at every call.

    Examples
    --------
    >>> rimless_wheel().angles
    ('theta',)
    """
    c = Coordinates(("theta",), PARAMETERS)
    theta, length, mass = c.angle("theta"), c.parameter("leg_length"), c.parameter("mass")
    half = math.pi / c.parameter("spokes")
    centre = c.foot + length * ca.vertcat(ca.sin(theta), ca.cos(theta))
    following = theta - 2 * half
    landing = centre - length * ca.vertcat(ca.sin(following), ca.cos(following))
    inertia = c.parameter("inertia_ratio") * mass * length**2
    robot = assemble(
        "rimless_wheel",
        c,
        description="rimless wheel: a rigid body rolling on spokes",
        bodies=[RigidLink(mass, centre, inertia, theta)],
        step=StepEnd(
            landing=PointContact(landing),
            touchdown=half - theta,
            armed=theta,
            exchange=[following],
            upright=theta + half + 1e-9,  # the step starts at -half; below it, the wheel rolls back
        ),
        actuators={},
        drawing=Drawing(
            {"stance foot": c.foot, "centre": centre, "next foot": landing},
            [("stance foot", "centre"), ("centre", "next foot")],
        ),
    )
    return exempt_from_step_check(robot)
