"""A robot with a mistake is refused in a sentence by every verb that would use it."""

import dataclasses
import math

import casadi as ca
import pytest

from gaitopt import Collocation, InputError, Ipopt, Parameter
from gaitopt.model import JointStop, PointContact, PointMass, assemble_planar, check_planar, monopod
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.motion.conflict import Conflict
from gaitopt.ocp import PlanarProblem, solve_planar
from gaitopt.ocp.multicontact.planar_remarks import report_unmet_arming
from gaitopt.ocp.multicontact.possible_causes import (
    find_sequence_of_impacts,
    report_soft_touchdowns,
    report_unarmed_contacts,
)
from gaitopt.simulation import place_planar, simulate_planar
from gaitopt.simulation.remedy_trials import try_remedies
from gaitopt.stability import PlanarWalkProblem
from gaitopt.status import Status
from gaitopt.study.storage.failure_reason import explain_failure

MIRROR = {"a": "b", "foot a": "foot b", "hip": "-hip"}

PASSES = r"The check passes with mirror=\{'a': 'b', 'foot a': 'foot b', 'hip': '-hip'\}\.$"


def make_biped(mirror=MIRROR, *, leg_mass=0.5, stop=None, armed=True, place=lambda hip, foot: foot):
    """Return a biped whose feet, if armed, land in front only, or behind if it is -1; a stop limits a coordinate.

    The positions of the contacts are those of the feet, or what `place` returns for hip and foot.
    """
    c = PlanarCoordinates(("x", "y", "a", "b"), [Parameter("gravity", 9.81, "m/s^2", "gravity", lower=0)])
    hip, bodies, contacts = ca.vertcat(c.coordinate("x"), c.coordinate("y")), [], {}
    masses = leg_mass if isinstance(leg_mass, tuple) else (leg_mass, leg_mass)
    for (leg, other), mass in zip(("ab", "ba"), masses, strict=True):
        foot = hip + ca.vertcat(ca.sin(c.coordinate(leg)), -ca.cos(c.coordinate(leg)))
        ahead = armed * (c.coordinate(leg) - c.coordinate(other)) if armed else None
        contacts[f"foot {leg}"] = PointContact(place(hip, foot), armed=ahead)
        bodies += [PointMass(mass, (hip + foot) / 2)] if mass else []
    if stop is not None:
        contacts["stop"] = JointStop(1 - c.coordinate(stop))
    actuators = {"hip": c.coordinate("a") - c.coordinate("b")}
    bodies.append(PointMass(1.0, hip))
    return assemble_planar("biped", c, bodies=bodies, contacts=contacts, actuators=actuators, mirror=mirror)


def solve(robot):
    walk = {"friction": 1.0, "speed": 0.5, "step_length": 0.4, "objective": "torque_squared"}
    method = Collocation(intervals=4)
    return solve_planar(PlanarProblem(robot=robot, sequence="foot a stick |", transcription=method, **walk))


def search(robot):
    start = {"coordinates": {"x": 0, "a": 0.2, "b": -0.2}, "rates": {"a": -1, "b": 0}, "on": ("foot a",)}
    return next(PlanarWalkProblem(robot=robot, section="foot b closes", **start).search(1))


def test_the_right_robot_passes():
    assert check_planar(make_biped()).passed
    assert solve(make_biped()).status.ok


@pytest.mark.parametrize("use", [solve, search])
@pytest.mark.parametrize(
    ("robot", "message"),
    [
        (
            make_biped({"a": "b", "hip": "-hip"}),
            f"the mirror must not change the equations, but changes gaps, .* "
            f"Contacts missing from the mirror: 'foot a', 'foot b'. {PASSES}",
        ),
        (
            make_biped({name: other for name, other in MIRROR.items() if name != "a"}),
            f"the mirror must not change the equations, .* Coordinates missing from the mirror: 'a', 'b'. {PASSES}",
        ),
        (
            make_biped({**MIRROR, "hip": "hip"}),
            f"changes actuation .*: actuator 'hip', whose sign in the mirror must be reversed. {PASSES}",
        ),
        (make_biped(leg_mass=(0.5, 0.4)), "changes mass matrix, bias forces .* compare masses, lengths, directions"),
        (
            make_biped(leg_mass=0),
            "the mass matrix is singular, because no mass or inertia moves with 'a', 'b'; every coordinate",
        ),
        (
            make_biped(place=lambda hip, foot: foot - hip),
            "contact 'foot a' does not move with the bodies: .* moved forward .* slide coordinate changes by 0 m",
        ),
        (
            make_biped(place=lambda hip, foot: ca.vertcat(foot[0], -foot[1])),
            "contact 'foot b' does not move with the bodies: .* lifted .* gap changes by -1 m",
        ),
    ],
    ids=[
        "contact missing from the mirror",
        "coordinate missing from the mirror",
        "sign missing from the mirror",
        "different legs",
        "massless legs",
        "relative",
        "reversed",
    ],
)
def test_a_wrong_robot_is_refused(use, robot, message):
    with pytest.raises(InputError, match=message):
        use(robot)


def test_straight_legs_without_arming_condition_have_the_remedy():
    clearance = Conflict(
        name="clearance", setting="PlanarLimits.clearance", limit=0.0, missing=0.1, sufficient=math.nan, unit="m",
        separable=True,
    )  # fmt: skip
    walk = {"friction": 1.0, "speed": 0.5, "step_length": 0.4}
    problems = [
        PlanarProblem(robot=make_biped(armed=armed), sequence="foot a stick |", **walk) for armed in (False, True)
    ]
    (remark,) = report_unarmed_contacts(problems[0], [clearance])
    assert remark.startswith("foot b must stay above the ground while free: a foot of a straight leg")
    assert report_unarmed_contacts(problems[1], [clearance]) == ()
    assert report_unarmed_contacts(problems[0], [dataclasses.replace(clearance, setting="speed")]) == ()
    assert report_unarmed_contacts(problems[0], ()) == (f"possible cause: {remark}",)
    assert report_unarmed_contacts(problems[1], ()) == ()


@pytest.mark.parametrize("armed", [False, True])
def test_a_failed_solve_without_conflicts_names_the_missing_arming_condition(armed):
    walk = {"friction": 1.0, "speed": 0.5, "step_length": 0.4, "transcription": Collocation(intervals=4)}
    problem = PlanarProblem(robot=make_biped(armed=armed), sequence="foot a stick |", **walk)
    gait = solve_planar(problem, solver=Ipopt(max_iterations=2))
    assert gait.status is Status.ITERATION_LIMIT
    assert gait.solver.conflicts == ()
    assert any(text.startswith("possible cause: foot b must") for text in gait.solver.warnings) is not armed


def test_a_foot_that_swings_while_no_other_one_is_on_the_ground_needs_no_arming_condition():
    problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.0)
    assert report_unarmed_contacts(problem, ()) == ()


def test_a_failed_solve_names_a_soft_touchdown_with_the_sequence_of_an_impact():
    walk = {"friction": 1.0, "speed": 0.5, "step_length": 0.4, "transcription": Collocation(intervals=10)}
    problem = PlanarProblem(robot=make_biped(), sequence="foot a stick >", **walk)
    gait = solve_planar(problem, solver=Ipopt(max_iterations=2))
    (remark,) = report_soft_touchdowns(problem)
    assert remark.startswith("foot b closes at '>', that is without impulse")
    assert remark.endswith("For a touchdown with an impact, write '|': 'foot a stick |'.")
    assert gait.solver.warnings[0] == remark
    assert explain_failure(gait).startswith(f"{'no gait found; ' if gait.solver.violations else ''}{remark[:-1]}; ")
    assert report_soft_touchdowns(problem.replace(sequence="foot a stick |")) == ()


def test_a_gait_with_impacts_is_found_for_a_sequence_without_them():
    walk = {"friction": 1.0, "speed": 0.5, "step_length": 0.4, "transcription": Collocation(intervals=4)}
    options = {"objective": "torque_squared", **walk}
    problem = PlanarProblem(robot=make_biped(), sequence="foot a stick >", **options)
    failure = solve_planar(problem, solver=Ipopt(max_iterations=2))
    first, second, *_ = try_remedies(problem, failure).solver.warnings
    assert (first,) == report_soft_touchdowns(problem)
    assert second == "A verified gait was found with impacts, sequence='foot a stick |', and no other change."
    sequence = "foot a stick |"
    assert find_sequence_of_impacts(problem.replace(sequence=sequence)) is None


@pytest.mark.parametrize(
    ("armed", "advice"),
    [
        (-1, "check the sign of the expression."),
        (True, "as in `armed=ahead - 0.1`, use a smaller one."),
    ],
    ids=["reversed", "right"],
)
def test_only_a_reversed_arming_condition_is_advised_to_be_checked(armed, advice):
    problem = PlanarProblem(robot=make_biped(armed=armed), sequence="foot a stick |", friction=1.0, step_length=0.4)
    conflict = Conflict(
        name="speed", setting="speed", limit=1.0, missing=0.1, sufficient=math.nan, unit="m/s", separable=True
    )
    assert report_unmet_arming(problem, [conflict]) == ()
    (remark,) = report_unmet_arming(problem, [dataclasses.replace(conflict, setting="Margins.touchdown_armed")])
    assert remark.endswith(advice)


def test_a_stop_on_a_coordinate_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match=r"There is no coordinate 'knee'\. Known: x, y, a, b\."):
        make_biped(stop="knee")


def test_a_stop_that_depends_on_no_coordinate_is_refused():
    c = PlanarCoordinates(("y",), [Parameter("gravity", 9.81, "m/s^2", "gravity")])
    body = PointMass(1.0, ca.vertcat(0, c.coordinate("y")))
    with pytest.raises(InputError, match="gap of contact 'stop' depends on no coordinate"):
        assemble_planar("ball", c, bodies=[body], contacts={"stop": JointStop(ca.SX(1.0))})


@pytest.mark.parametrize(
    ("armed", "message"),
    [
        (False, "Contact 'foot a' starts below the ground: its gap must be at least 0, got"),
        (True, r"All feet start below the ground: .* got 'foot a': -0\.095, 'foot b': -0\.0801\."),
    ],
)
def test_feet_that_start_below_the_ground_are_refused(armed, message):
    with pytest.raises(InputError, match=message):
        simulate_planar(make_biped(armed=armed), [0, 0.9, 0.1, -0.2], [0, 0, 0, 0], {})


def test_a_foot_may_swing_below_the_ground():
    """Straight legs that pass each other: the swing foot is 3 cm below the ground."""
    robot = make_biped()
    q, v = place_planar(robot, {"x": 0, "a": 0.2, "b": 0}, {"a": -1, "b": 1}, {}, on=["foot a"])
    assert simulate_planar(robot, q, v, {"friction": 2.0}, duration=0.05).stop.key == "duration_done"
