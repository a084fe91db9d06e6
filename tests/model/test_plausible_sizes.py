"""Implausible sizes of robots are reported with the likely unit."""

import math
import re

import casadi as ca
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    PointContact,
    RigidLink,
    check_robot,
    compass_biped,
    solve,
)
from gaitopt.model import PlanarCoordinates, assemble_planar, check_planar
from gaitopt.model.planar.plausible_geometry import report_implausible_geometry
from gaitopt.model.plausible_sizes import report_implausible_sizes
from gaitopt.model.robots.catalogue import CATALOGUE
from gaitopt.model.robots.planar_catalogue import PLANAR_CATALOGUE
from gaitopt.ocp import Ipopt, PlanarLimits, solve_planar
from gaitopt.parameters import Parameter
from tests.problems.test_wrong_robots import make_biped
from tests.walkers.heel_toe import Build, heel_toe_step, heel_toe_walker

GRAVITY = Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")


@pytest.mark.parametrize("name", [*CATALOGUE, *PLANAR_CATALOGUE])
def test_robots_of_the_catalogue_are_plausible(name):
    robot = (CATALOGUE | PLANAR_CATALOGUE)[name]()
    assert report_implausible_sizes(robot, robot.resolve({})) == ()
    if name in PLANAR_CATALOGUE:
        assert report_implausible_geometry(robot, robot.resolve({})) == ()


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (Build(heel=-4.0, toe=8.0), "the distance of 12 m between contacts 'heel a' and 'toe a' .* cm, state 0.12 m."),
        (Build(heel=-0.05, toe=5.0), "the distance of 5.05 m between .* the centre of mass is .* cm, state 0.0505 m."),
        (Build(heel=0.05, toe=-0.09), "contact 'toe a' is behind 'heel a' and .* the direction from heel to toe, .*"),
        (
            Build(leg_length=-1.0, leg_com=-0.5),
            r"in poses with small angles, all feet \(heel a, .*\) are above the centre of mass: check the direction .*",
        ),
    ],
    ids=["foot in cm", "toe in cm", "toe behind the heel", "legs point up"],
)
def test_reversed_directions_and_long_feet_are_reported(build, sentence):
    robot = heel_toe_walker(0.05, build)
    check = check_planar(robot, states=2)
    assert check.passed
    (remark,) = check.remarks
    assert re.fullmatch(f"Robot 'heel-toe walker': {sentence}", remark)


def test_a_long_foot_is_a_warning_of_a_solve():
    gait = solve(heel_toe_step(0.05, build=Build(toe=5.0)), solver=Ipopt(max_iterations=1))
    assert any("between contacts 'heel a' and 'toe a' of one body is implausible" in w for w in gait.solver.warnings)


def test_feet_that_are_armed_behind_the_other_leg_are_reported():
    assert check_planar(make_biped(), states=2).remarks == ()
    (remark,) = check_planar(make_biped(armed=-1), states=2).remarks
    assert "`armed` of 'foot a', 'foot b' is positive only where the contact is behind that of the other leg" in remark


def test_negative_gravity_is_reported():
    robot = rod(0.9, 0.34)
    assert check_planar(robot, {"gravity": -9.81}).remarks == (
        "gravity = -9.81 m/s^2 is implausible: gravity points down if the value is positive. State 9.81 m/s^2.",
    )


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"leg_length": 900.0}, "leg_length = 900 m is implausible: .* in mm, state 0.9 m."),
        ({"leg_length": 90.0}, "leg_length = 90 m is implausible: .* in cm, state 0.9 m."),
        ({"leg_length": 9e-4, "leg_com": 5e-4}, "leg_length = 0.0009 m is implausible: .* in km, state 0.9 m."),
        ({"leg_mass": 5000.0}, "leg_mass = 5000 kg is implausible: .* in g, state 5 kg."),
        ({"gravity": 9810.0}, r"gravity = 9810 m/s\^2 is implausible: .* in mm/s\^2, state 9.81 m/s\^2."),
    ],
)
def test_a_parameter_in_another_unit_is_reported_with_this_unit(values, sentence):
    robot = compass_biped()
    check = check_robot(robot, values, states=2)
    assert len(check.remarks) == 1
    assert re.fullmatch(sentence, check.remarks[0])


def rod(length, inertia, parameters=(GRAVITY,)):
    """Return a rod that falls over, with two contacts at its ends."""
    c = PlanarCoordinates(("x", "y", "a"), parameters)
    end = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    ahead = length * ca.vertcat(ca.sin(c.coordinate("a")), ca.cos(c.coordinate("a")))
    value = c.parameter("rod_inertia") if inertia is None else inertia
    mass = c.parameter("rod_mass") if inertia is None else 5.0
    body = RigidLink(mass, end + ahead / 2, value, c.coordinate("a"))
    return assemble_planar(
        "rod", c, bodies=[body], contacts={"one": PointContact(end), "other": PointContact(end + ahead)}
    )


def test_lengths_and_inertias_that_are_no_parameters_are_found_by_drawing_and_mass_matrix():
    assert check_planar(rod(0.9, 0.34)).remarks == ()
    (length,) = check_planar(rod(900.0, 0.34e6)).remarks
    assert "points of its drawing are up to 900 m apart" in length
    check = check_planar(rod(0.9, 3400.0))
    assert check.passed
    assert "inertia 3.4e+03 kg m^2 of coordinate 'a' is implausible" in check.remarks[0]
    assert check.remarks[0] in str(check)


def test_an_inertia_that_does_not_fit_its_mass_is_reported_with_the_unit():
    inertia = Parameter("rod_inertia", 3400.0, "kg m^2", "inertia")
    robot = rod(0.9, None, (GRAVITY, inertia, Parameter("rod_mass", 5.0, "kg", "mass")))
    (sentence,) = check_planar(robot).remarks
    assert sentence.startswith("rod_inertia = 3400 kg m^2 is implausible: with a mass of 5 kg the radius of gyration")
    assert sentence.endswith("If the value is in kg cm^2, state 0.34 kg m^2.")


def test_a_solve_warns_of_implausible_sizes():
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.5,
        speed=0.7,
        step_length=0.4,
        parameters={"leg_mass": 5000.0},
    )
    gait = solve(problem, solver=Ipopt(max_iterations=2))
    assert any(warning.startswith("leg_mass = 5000 kg is implausible") for warning in gait.solver.warnings)


def test_masses_that_are_no_parameters_are_found_by_the_total_mass():
    robot = heel_toe_walker(0.05, Build(leg_mass=3000.0))
    (sentence,) = report_implausible_sizes(robot, robot.resolve({}))
    assert sentence.endswith(
        "mass of 6012 kg is implausible: masses of the parts of a robot are at most 1000 kg. Masses must be in kg."
    )
    assert report_implausible_sizes(heel_toe_walker(0.05), robot.resolve({})) == ()


def test_a_solve_warns_of_a_step_that_is_implausible_for_the_robot():
    problem = heel_toe_step(0.05).replace(step_length=420.0, speed=None)
    gait = solve(problem, solver=Ipopt(max_iterations=2))
    text = "step_length = 420 m is implausible: the largest length of the robot is 1 m. If the value is in mm, state"
    assert gait.solver.warnings[0] == f"{text} 0.42 m."


def test_a_step_of_several_contacts_that_takes_too_long_is_refused():
    with pytest.raises(InputError, match=r"takes 525 s, more than PlanarLimits\.longest_step = 10 s"):
        heel_toe_step(0.05).replace(step_length=420.0, speed=0.8)


def test_a_slope_in_degrees_is_refused_with_its_value_in_radians():
    with pytest.raises(InputError, match=r"got 3. If the value is in degrees, state 0.05236 rad\.$"):
        heel_toe_step(0.05).replace(slope=3.0)
    with pytest.raises(InputError, match=r"got 300.$"):
        heel_toe_step(0.05).replace(slope=300.0)


def test_bounds_of_angles_in_degrees_are_the_first_warnings():
    few = Ipopt(max_iterations=1)
    problem = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.25, step_length=0.45, speed=0.6,
        limits=Limits(torque=6, angle={"th1": (-30, 30)}), objective="torque_squared",
        transcription=Collocation(intervals=6),
    )  # fmt: skip
    assert solve(problem, solver=few).solver.warnings[0] == (
        "Limits.angle of th1 = (-30, 30) rad is implausible: it is (-1719, 1719) deg, and a bound of an angle is at "
        "most 6.28 rad in size. If the value is in degrees, state (math.radians(-30), math.radians(30))."
    )
    limits = PlanarLimits(coordinate={"x": (-50, 50), "a": (-17, math.inf), "b": (-1, 1)})
    warnings = solve_planar(heel_toe_step(0.05).replace(limits=limits), solver=few).solver.warnings
    assert warnings[0].startswith("PlanarLimits.coordinate of a = (-17, inf) rad is implausible")
    assert warnings[0].endswith("If the value is in degrees, state (math.radians(-17), math.inf).")
    assert not any("coordinate of b" in each or "coordinate of x" in each for each in warnings)
