"""Masses and inertias that are expressions of parameters: refused where a value makes one of them negative."""

import casadi as ca
import pytest

from gaitopt import Coordinates, GaitProblem, InputError, Limits, Parameter, PointMass, StepEnd, assemble, check_robot
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.model.robot_serialisation import read_fields
from gaitopt.model.uneven_ground import adapt_to_uneven_ground
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

PARAMETERS = [
    Parameter("gravity", 9.8, "m/s^2", "gravity", lower=0.0),
    Parameter("leg_mass", 4.0, "kg", "mass of a leg"),
    Parameter("m_hip", 20.0, "kg", "mass of hip and legs"),
]
TOO_HEAVY = r"mass of body 3 must not be negative \[kg\], got -1 for leg_mass = 10.5 kg, m_hip = 20 kg\.$"


def compass():
    """Return a biped whose hip has what its legs leave of the total mass."""
    c = Coordinates(["stance", "swing"], PARAMETERS)
    stance, swing, leg = c.angle("stance"), c.angle("swing"), c.parameter("leg_mass")
    hip = c.foot + ca.vertcat(-ca.sin(stance), ca.cos(stance))
    foot = hip + ca.vertcat(ca.sin(swing), -ca.cos(swing))
    bodies = [PointMass(leg, (c.foot + hip) / 2), PointMass(leg, (hip + foot) / 2)]
    return assemble(
        "compass",
        c,
        bodies=[*bodies, PointMass(c.parameter("m_hip") - 2 * leg, hip)],
        step=StepEnd(
            landing=foot,
            touchdown=stance + swing,
            armed=-stance,
            exchange=[swing, stance],
            upright=ca.cos(stance),
        ),
        actuators={"hip": stance + swing},
    )


def hopper():
    """Return a body on a massive foot that have a constant total mass."""
    c = PlanarCoordinates(["x", "y", "leg"], PARAMETERS)
    body = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    foot, mass = body - ca.vertcat(0, c.coordinate("leg")), c.parameter("leg_mass")
    return assemble_planar(
        "hopper",
        c,
        bodies=[PointMass(mass, foot), PointMass(mass, foot), PointMass(c.parameter("m_hip") - 2 * mass, body)],
        contacts={"foot": PointContact(foot)},
        actuators={"leg": c.coordinate("leg")},
    )


def test_a_mass_that_is_negative_at_the_values_of_a_problem_is_named():
    with pytest.raises(InputError, match=f"Robot 'compass': {TOO_HEAVY}"):
        GaitProblem(robot=compass(), sequence="stick | stick", friction=0.5, parameters={"leg_mass": 10.5})
    with pytest.raises(InputError, match=f"Robot 'hopper': {TOO_HEAVY}"):
        PlanarProblem(robot=hopper(), sequence="foot stick > flight |", parameters={"leg_mass": 10.5})
    with pytest.raises(InputError, match=TOO_HEAVY):
        check_robot(compass(), {"leg_mass": 10.5})


def test_a_mass_of_zero_is_accepted():
    assert compass().resolve({"leg_mass": 10.0})["leg_mass"] == 10.0


def test_bounds_of_free_parameters_that_allow_a_negative_mass_are_refused():
    stated = {"sequence": "stick | stick", "friction": 0.5, "limits": Limits(torque=6)}
    message = r"free: the bounds of leg_mass must be narrower\. Robot 'compass': mass of body 3 .* leg_mass = 12 kg"
    with pytest.raises(InputError, match=message):
        GaitProblem(robot=compass(), **stated, free={"leg_mass": (1, 12)})
    assert GaitProblem(robot=compass(), **stated, free={"leg_mass": (1, 9)}).free == {"leg_mass": (1.0, 9.0)}
    with pytest.raises(InputError, match=r"must be narrower\. Robot 'hopper': mass of body 3"):
        PlanarProblem(robot=hopper(), sequence="foot stick > flight |", free={"leg_mass": (1, 12)})


def test_stored_robots_keep_the_expressions():
    stored = Robot(**read_fields(compass().record))
    with pytest.raises(InputError, match=TOO_HEAVY):
        stored.resolve({"leg_mass": 10.5})
    content = hopper().record.content()
    assert "inertias" in content["functions"]
    with pytest.raises(InputError, match=TOO_HEAVY):
        PlanarRobot.from_record(hopper().record).resolve({"leg_mass": 10.5})


def test_a_robot_on_uneven_ground_is_checked_too():
    """Its parameters are in another order."""
    adapted = adapt_to_uneven_ground(compass())
    assert adapted.resolve({"leg_mass": 9.5, "rise": 0.01})["leg_mass"] == 9.5
    with pytest.raises(InputError, match=TOO_HEAVY):
        adapted.resolve({"leg_mass": 10.5, "rise": 0.01})


def test_masses_that_are_parameters_are_checked_by_their_bounds():
    """So that robots of the catalogue store nothing more."""
    c = Coordinates(["angle"], PARAMETERS)
    angle = c.angle("angle")
    tip = c.foot + ca.vertcat(ca.sin(angle), ca.cos(angle))
    step = StepEnd(landing=tip, touchdown=1 - angle, armed=angle, exchange=[-angle], upright=ca.cos(angle))

    def assemble_rod(mass):
        return assemble("rod", c, bodies=[PointMass(mass, tip)], step=step, actuators={"ankle": angle})

    leg = c.parameter("leg_mass")
    assert all(assemble_rod(mass).inertias is None for mass in (leg, 2 * leg + leg**2 / 12))
    assert all(assemble_rod(mass).inertias is not None for mass in (9 - leg, leg - 1, leg * (-leg) + 99, 2 / leg))
    with pytest.raises(InputError, match="leg_mass must be at least 0"):
        assemble_rod(c.parameter("leg_mass")).resolve({"leg_mass": -1})
    with pytest.raises(InputError, match=r"mass of body 1 must not be negative \[kg\], got -1 for m_hip = -1 kg"):
        assemble_rod(c.parameter("m_hip")).resolve({"m_hip": -1})
