"""The impact of a planar robot in a state, with all contacts that are closed or closing there."""

from collections.abc import Mapping

import numpy as np

from gaitopt.arguments import check_arguments, check_vector
from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import GAP_TOLERANCE
from gaitopt.model.contacts.multicontact_impact import ImpactOutcome
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.contact_resolution import ContactResolution

SEPARATION = 1e-9
"""Speeds of separation below this value [m/s] count as zero."""


@check_arguments
def solve_planar_impact(robot: PlanarRobot, q: Array, v: Array, parameters: Mapping[str, float]) -> ImpactOutcome:
    """Solve the impact of a planar robot in a state.

    All contacts with zero gap that do not separate take part.  Contacts that end the motion do not, and a foot that
    cannot close (:attr:`PlanarRobot.arming`) takes part only if it is at rest.  Joint stops are unilateral, except that
    those that are latched by their kind and at rest transmit impulses of either sign.

    Parameters
    ----------
    robot : PlanarRobot
    q, v : (n_q,) arrays
        State before the impact.
    parameters : mapping of str to float
        Those not named keep their defaults.

    Returns
    -------
    ImpactOutcome

    Raises
    ------
    InputError
        If no contact is closed or closing, one is below the ground or beyond its limit, or a parameter is invalid.

    Examples
    --------
    >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
    >>> from gaitopt.simulation import place_planar, solve_planar_impact
    >>> robot = compass_with_two_feet()
    >>> q, v = place_planar(robot, {"x": 0, "a": -0.15, "b": 0.15}, {"a": -1, "b": 0.1}, {}, on=["foot A"])
    >>> outcome = solve_planar_impact(robot, q, v, {"friction": 0.14})
    >>> {name: mode.value for name, mode in outcome.modes.items()}
    {'foot A': 'free', 'foot B': 'slip+'}
    """
    q, v = check_vector("q", q, robot.n_q), check_vector("v", v, robot.n_q)
    p = robot.vector(robot.resolve(parameters))
    contacts = ContactResolution(robot, p)
    kinematics, armed = contacts.kinematics(q, v), np.array(robot.arming(q, v, p)).ravel()
    touching = []
    for i, contact in enumerate(robot.contacts):
        gap, speed = kinematics.gap[i], kinematics.normal_speed[i]
        if contact.falls or (armed[i] <= 0 and abs(speed) > SEPARATION):
            continue
        if gap < -GAP_TOLERANCE and armed[i] > 0:
            place = f"{contact.unit} beyond its limit" if contact.kind == "stop" else "m below the ground"
            raise InputError(
                f"Contact {contact.name!r} is {-gap:.6g} {place} in this state; its gap must be at least 0."
            )
        if abs(gap) <= GAP_TOLERANCE and speed <= SEPARATION:
            touching.append(i)
    if not touching:
        gaps = ", ".join(f"{c.name} {g:.3g}" for c, g in zip(robot.contacts, kinematics.gap, strict=True))
        raise InputError(
            f"No contact is closed or closing (zero gap, not separating) in this state; gaps [m or rad]: {gaps}. "
            "State a pose in which a contact touches the ground, such as that of place_planar(robot, coordinates, "
            "rates, parameters, on=[contact])."
        )
    latched = frozenset(
        i for i in touching if robot.contacts[i].latched and abs(kinematics.normal_speed[i]) <= SEPARATION
    )
    return contacts.impact(q, v, touching, latched)
