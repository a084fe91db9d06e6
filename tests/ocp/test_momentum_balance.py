"""The momentum balance along the ground refuses a problem only if nothing else acts along the ground."""

import math

import casadi as ca
import pytest

from gaitopt import GaitProblem, Limits, Parameter, PointContact, PointMass, Status, compass_biped
from gaitopt.model import JointStop, PlanarCoordinates, assemble_planar, monopod
from gaitopt.model.forces import Potential
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.ocp import PlanarProblem, solve_planar
from gaitopt.ocp.multicontact.momentum_balance import explain_imbalance
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility, explain_unequal_slip
from gaitopt.ocp.solution import impossible_sequences
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility


def block(*forces, **stops):
    c = PlanarCoordinates(("x", "y"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    return assemble_planar(
        "block",
        c,
        bodies=[PointMass(1.0, place)],
        contacts={"foot": PointContact(place), **{name: stop(place) for name, stop in stops.items()}},
        actuators={"lift": place[1]},
        forces=[force(place) for force in forces],
    )


def test_a_constant_force_along_the_ground_may_balance_friction():
    problem = PlanarProblem(robot=block(), sequence="foot slip- > flight |", friction=0.1, speed=1.0)
    assert explain_imbalance(problem) is not None
    assert explain_imbalance(problem.replace(robot=block(lambda place: Potential(5 * place[0])))) is None
    steep = problem.replace(sequence="foot stick > flight |", slope=0.3)
    assert explain_imbalance(steep) is not None
    assert explain_planar_impossibility(steep) == explain_imbalance(steep)
    assert explain_imbalance(steep.replace(robot=block(lambda place: Potential(5 * place[0])))) is None


def test_a_robot_that_moves_vertically_is_not_refused_on_a_slope():
    c = PlanarCoordinates(("y",), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")])
    place = ca.vertcat(0, c.coordinate("y"))
    lift = assemble_planar(
        "lift", c, bodies=[PointMass(1.0, place)], contacts={"foot": PointContact(place)},
        actuators={"lift": place[1]},
    )  # fmt: skip
    options = {"objective": "torque_squared", "friction": 0.1, "slope": 0.3}
    assert explain_imbalance(PlanarProblem(robot=lift, sequence="foot stick > flight |", **options)) is None


def test_an_impact_that_sticks_may_balance_the_slip_of_all_phases():
    slip = PlanarProblem(robot=monopod(), sequence="foot slip+ > flight |", friction=0.3, speed=1.5)
    assert explain_imbalance(slip) is not None
    assert explain_imbalance(slip.replace(sequence="foot slip+ > flight | [foot stick]")) is None


def test_the_stops_of_joints_do_not_hide_the_slip_of_the_feet():
    sequence = "foot A slip+, knee A latched | foot A slip+, knee A latched, knee B latched |"
    problem = PlanarProblem(robot=kneed_walker(), sequence=sequence, friction=0.3, speed=0.5)
    assert "all contacts slip forward all the time" in explain_imbalance(problem)
    stick = sequence.replace("slip+, knee A latched, knee B", "stick, knee A latched, knee B")
    assert explain_imbalance(problem.replace(sequence=stick)) is None


def test_stops_of_different_kinds_are_not_contacts_of_one_body():
    stops = {
        "latch": lambda place: JointStop(1 - place[1], latched=True),
        "end": lambda place: JointStop(1 - place[1]),
    }
    problem = PlanarProblem(
        robot=block(**stops), sequence="foot stick, latch latched, end closed > flight |", friction=0.3, speed=1.0
    )
    assert explain_unequal_slip(problem) is None


@pytest.mark.parametrize("sequence", ["foot any > flight |", "any", "foot slip+ > foot any > flight |"])
def test_an_open_sequence_is_refused_on_a_steep_slope_only(sequence):
    problem = PlanarProblem(robot=monopod(), sequence=sequence, friction=0.1, speed=1.0, slope=-0.2)
    assert "-tan(slope) = 0.2027 exceeds friction 0.1" in explain_planar_impossibility(problem)
    assert explain_planar_impossibility(problem.replace(slope=0.0)) is None
    gait = solve_planar(problem)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert "-tan(slope) = 0.2027 exceeds friction 0.1" in gait.solver.message


def test_a_problem_of_one_foot_is_refused_only_if_nothing_else_acts_along_the_ground(monkeypatch):
    steep = GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.1, slope=0.3, speed=0.6, limits=Limits(torque=6)
    )
    assert explain_impossibility(steep.sequence, steep) != ""
    monkeypatch.setattr(impossible_sequences, "is_free_along_ground", lambda robot, values, place: False)
    assert explain_impossibility(steep.sequence, steep) == ""


def test_a_slip_is_balanced_within_rounding_errors_only():
    for sign, sequence in ((1, "foot slip+ > flight |"), (-1, "foot slip- > flight |")):
        for error, refused in ((0.0, False), (1e-7, False), (1e-4, True)):
            problem = PlanarProblem(
                robot=monopod(), sequence=sequence, friction=math.tan(0.1) + error, speed=1.0, slope=sign * 0.1
            )
            assert (explain_imbalance(problem) is not None) is refused
