"""The coordinate along the ground: misspelled, or not declared as the travel of the robot."""

import functools
import re

import casadi as ca
import pytest

from gaitopt import Collocation, InputError, Ipopt
from gaitopt.model import PlanarCoordinates, PointContact, PointMass, assemble_planar
from gaitopt.model.planar.undeclared_travel import find_undeclared_travel
from gaitopt.model.robots.planar_catalogue import PLANAR_CATALOGUE
from gaitopt.motion.gait import IMPLAUSIBLE
from gaitopt.ocp import PlanarProblem, solve_planar
from gaitopt.stability import PlanarWalkProblem

REMARK = (
    "Robot 'biped': coordinate 'along' moves the whole robot along the ground, but is not declared as its travel, so "
    "that it must return to its initial value in every period: declare it by PlanarCoordinates(('along', 'y', 'a', "
    "'b'), ..., travel='along')."
)


@functools.cache
def biped(travel=None, *, anchored=False):
    """Return a biped whose hip moves along the ground by `along`, or on a link of a body that `along` does not move."""
    c = PlanarCoordinates(("along", "y", "a", "b"), travel=travel)
    hip, contacts = ca.vertcat(c.coordinate("along"), c.coordinate("y")), {}
    bodies = [PointMass(1.0, hip)]
    for leg, other in ("ab", "ba"):
        angle = c.coordinate(leg)
        foot = hip + ca.vertcat(ca.sin(angle), -ca.cos(angle))
        contacts[f"foot {leg}"] = PointContact(foot, armed=angle - c.coordinate(other))
        bodies.append(PointMass(0.5, (hip + foot) / 2))
    if anchored:
        bodies.append(PointMass(1.0, ca.vertcat(0, c.coordinate("y"))))
    return assemble_planar(
        "biped",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={"hip": c.coordinate("a") - c.coordinate("b")},
        mirror={"a": "b", "foot a": "foot b", "hip": "-hip"},
    )


def state_problem(robot, **changes):
    options = {"friction": 1.0, "objective": "torque_squared", "transcription": Collocation(intervals=4)}
    return PlanarProblem(robot=robot, sequence="foot a stick |", **(options | changes))


def test_a_misspelled_travel_is_named_with_the_coordinates():
    message = "travel: there is no coordinate 'alog'. Did you mean 'along'? Known: along, y, a, b."
    with pytest.raises(InputError, match=re.escape(message)):
        PlanarCoordinates(("along", "y", "a", "b"), travel="alog")


def test_a_coordinate_x_is_the_travel_unless_another_one_is_stated():
    assert PlanarCoordinates(("x", "y")).travel == "x"
    assert PlanarCoordinates(("x", "along"), travel="along").travel == "along"
    assert PlanarCoordinates(("along", "y")).travel is None


def test_undeclared_travel_is_found_and_other_coordinates_are_not():
    assert find_undeclared_travel(biped(), biped().resolve({"slope": 0.1})) == "along"
    assert find_undeclared_travel(biped("along"), biped().resolve({})) is None
    assert find_undeclared_travel(biped(anchored=True), biped().resolve({})) is None


@pytest.mark.parametrize("name", list(PLANAR_CATALOGUE))
def test_robots_of_the_library_have_no_undeclared_travel(name):
    robot = PLANAR_CATALOGUE[name]()
    assert find_undeclared_travel(robot, robot.resolve({})) is None


@pytest.mark.parametrize("changes", [{"speed": 0.5}, {"step_length": 0.4}, {"objective": "cost_of_transport"}])
def test_a_problem_that_requires_travel_names_the_coordinate_to_declare(changes):
    with pytest.raises(InputError, match=re.escape(REMARK)):
        state_problem(biped(), **changes)
    state_problem(biped("along"), **changes)


def test_a_failed_solve_without_speed_states_the_undeclared_travel_first():
    gait = solve_planar(state_problem(biped()), solver=Ipopt(max_iterations=2))
    assert gait.solver.warnings[0] == REMARK
    assert solve_planar(state_problem(biped("along")), solver=Ipopt(max_iterations=2)).solver.warnings[:1] != (REMARK,)
    assert "travel" in IMPLAUSIBLE


def test_a_walk_whose_travel_is_not_declared_is_refused():
    start = {"coordinates": {"along": 0, "a": 0.2, "b": -0.2}, "rates": {"a": -1, "b": 0}, "on": ("foot a",)}
    with pytest.raises(InputError, match=re.escape(REMARK)):
        PlanarWalkProblem(robot=biped(), section="foot b closes", **start)
    PlanarWalkProblem(robot=biped("along"), section="foot b closes", **start)
