"""Problems of several contacts that no gait can solve: refused before the solve, with the reason."""

import dataclasses
import re

import casadi as ca
import numpy as np
import pytest

from gaitopt import ArcContact, InputError, Margins, Parameter, PointContact, RigidLink, Status
from gaitopt.lazy import Deferred
from gaitopt.model import PlanarCoordinates, assemble_planar
from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
from gaitopt.ocp import PlanarLimits, PlanarProblem, solve_planar
from gaitopt.ocp.multicontact.arming_range import explain_unreachable_arming, find_arming_range
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility, explain_unequal_slip
from gaitopt.simulation import remedy_trials
from gaitopt.simulation.remedy_trials import try_remedies
from gaitopt.study import search, sweep
from tests.walkers.heel_toe import heel_toe_step

LIMITS = {"a": (-0.8, 0.8), "b": (-0.8, 0.8)}
HEEL_STICKS = "heel a stick, toe a slip+ |"


def flat_foot_step(sequence="heel A stick |", **changes):
    limits = PlanarLimits(coordinate=LIMITS)
    return PlanarProblem(robot=flat_foot_walker(), sequence=sequence, speed=0.5, **({"limits": limits} | changes))


def arm(problem, condition):
    """Return a problem whose contacts are all armed by a function of q, v and p."""

    def build():
        arming = problem.robot.arming
        inputs = [ca.SX.sym(arming.name_in(i), arming.size1_in(i)) for i in range(3)]
        armed = condition(*inputs) * ca.DM.ones(len(problem.robot.contacts))
        return ca.Function("arming", inputs, [armed], arming.name_in(), arming.name_out())

    return problem.replace(robot=dataclasses.replace(problem.robot, arming=Deferred(build)))


@pytest.mark.parametrize(
    ("sequence", "choices"),
    [
        (HEEL_STICKS, "'heel a stick, toe a stick' or 'heel a slip+, toe a slip+'"),
        ("heel a slip+, toe a stick |", "'heel a slip+, toe a slip+' or 'heel a stick, toe a stick'"),
        ("heel a slip+, toe a slip- |", "'heel a slip+, toe a slip+' or 'heel a slip-, toe a slip-'"),
    ],
)
def test_contacts_of_one_body_that_slip_unequally_are_refused(sequence, choices):
    gait = solve_planar(heel_toe_step(0.05).replace(sequence=sequence))
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert gait.solver.message == (
        "heel a and toe a are contacts of one rigid body, so that they stick or slip together while both are closed, "
        f"but in phase 1 the sequence has '{sequence.removesuffix(' |')}': write {choices}"
    )


def test_an_impact_cannot_leave_contacts_of_one_body_with_unequal_slip():
    step = heel_toe_step(0.05).replace(sequence="heel a slip+ > heel a stick | [heel b stick, toe b slip+]")
    assert "in the impact after phase 2 the sequence has 'heel b stick, toe b slip+'" in explain_unequal_slip(step)


@pytest.mark.parametrize(
    "sequence",
    [
        "heel a stick, toe a stick |",
        "heel a slip+, toe a slip+ > toe a stick |",
        "heel a slip+ > toe a stick |",
        "heel a stick, toe b slip- > heel a stick |",
    ],
)
def test_slip_of_one_body_or_of_different_ones_is_not_refused(sequence):
    assert explain_planar_impossibility(heel_toe_step(0.05).replace(sequence=sequence)) is None


def test_a_sequence_with_open_modes_is_not_refused():
    assert explain_planar_impossibility(heel_toe_step(0.05).replace(sequence="heel a any, toe a any |")) is None


def test_two_arcs_of_one_body_on_the_ground_slip_together():
    """The reason of a refusal holds for arcs as well, whatever their radii."""
    c = PlanarCoordinates(("x", "y", "turn"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")])
    place, turn = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("turn")
    ahead, up = ca.vertcat(ca.cos(turn), -ca.sin(turn)), ca.vertcat(ca.sin(turn), ca.cos(turn))
    contacts = {
        "rear": ArcContact(place - 0.2 * ahead, 0.1, turn, body="foot"),
        "front": ArcContact(place + 0.3 * ahead + 0.05 * up, 0.2, turn, body="foot"),
        "point": PointContact(place + 0.1 * ahead - 0.1 * up, body="foot"),
    }
    rocker = assemble_planar("rocker", c, bodies=[RigidLink(1.0, place, 0.1, turn)], contacts=contacts)
    p = rocker.vector(rocker.resolve({}))
    q, closed = np.array([0.3, 0.1, 0.1]), [0, 1]
    for _ in range(20):
        gaps, rows = np.array(rocker.gaps(q, p)[0]).ravel(), np.array(rocker.rows(q, np.zeros(3), p)[0])
        q -= np.linalg.lstsq(rows[closed], gaps[closed], rcond=None)[0]
    normal, tangent = (np.array(part) for part in rocker.rows(q, np.zeros(3), p)[:2])
    motion = np.linalg.svd(normal[closed])[2][-1]
    assert abs(q[2]) > 0.01
    assert np.allclose(normal[closed] @ motion, 0.0, atol=1e-12)
    assert tangent[0] @ motion == pytest.approx(tangent[1] @ motion, rel=1e-12)


def test_a_contact_that_cannot_be_armed_within_the_limits_is_refused():
    gait = solve_planar(heel_toe_step(14.0, coordinate=LIMITS))
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert gait.solver.message == (
        "toe a and heel b must close, which requires that `armed` is at least 0.001 (Margins.touchdown_armed), but "
        "within PlanarLimits.coordinate, a in (-0.8, 0.8) rad and b in (-0.8, 0.8) rad, it is at most -12.4: decrease "
        "the threshold in `armed`, or extend the limits"
    )


@pytest.mark.parametrize(
    ("angle", "remark"),
    [
        (14, "If clearance_angle = 14 rad is in degrees, state 0.2443 rad"),
        (100, "or extend the limits"),  # it is too large in degrees as well
        (1.598, None),  # within the margin
    ],
)
def test_a_threshold_in_degrees_is_stated_in_rad(angle, remark):
    reason = explain_unreachable_arming(flat_foot_step(parameters={"clearance_angle": angle}))
    assert reason is None if remark is None else reason.endswith(remark)


def test_the_largest_value_of_an_affine_condition_is_that_at_the_limits():
    step = arm(flat_foot_step(), lambda q, v, p: 2 * (q[2] - q[4] / 4) - 7)
    found = find_arming_range(step, "heel B", step.values)
    assert (found.largest, found.coordinates) == (pytest.approx(1.6 + 0.4 - 7), ("a", "b"))
    assert explain_unreachable_arming(step) is not None


@pytest.mark.parametrize(
    "condition",
    [
        lambda q, v, p: ca.sin(q[2]) - 7,
        lambda q, v, p: ca.sign(q[2]) - 0.5,  # its derivative is zero
        lambda q, v, p: ca.if_else(q[2] > 0.1, 1, -1),
        lambda q, v, p: q[2] * q[4] - 7,
        lambda q, v, p: q[2] + 10 * ca.sign(q[4]) - 7,  # it is affine between the jumps
        lambda q, v, p: q[2] - 7 + v[2],
        lambda q, v, p: q[3] - 7,  # an angle without limits
        lambda q, v, p: ca.SX(-7),
    ],
)
def test_a_condition_whose_largest_value_is_not_known_is_not_refused(condition):
    assert explain_unreachable_arming(arm(flat_foot_step(), condition)) is None


def test_a_condition_with_a_free_threshold_is_not_refused():
    fixed = flat_foot_step(parameters={"clearance_angle": 3})
    assert explain_unreachable_arming(fixed) is not None
    assert explain_unreachable_arming(fixed.replace(parameters={}, free={"clearance_angle": (0, 3)})) is None
    place = fixed.robot.index("clearance_angle")
    added = arm(flat_foot_step(free={"clearance_angle": (0, 9)}), lambda q, v, p: q[2] + p[place] - 7)
    assert explain_unreachable_arming(added) is None


def test_a_contact_must_be_armed_by_the_margin_of_its_touchdown():
    step = arm(flat_foot_step(), lambda q, v, p: q[2] - 0.5)  # at most 0.3
    for margin, refused in ((0.3, False), (0.3 + 1e-7, False), (0.31, True)):
        margins = Margins(touchdown_armed=margin)
        assert (explain_unreachable_arming(step.replace(margins=margins)) is not None) is refused


def test_the_contact_that_is_armed_least_is_named():
    """One contact that cannot close excludes the sequence, whatever the others can do."""
    step = flat_foot_step("heel A stick | [heel B stick, toe B stick]")
    names = step.robot.contact_names
    thresholds = ca.DM([7.0 if name == "toe B" else 0.0 for name in names])
    reason = explain_unreachable_arming(arm(step, lambda q, v, p: q[2] - thresholds))
    assert reason.startswith("toe B must close")


def test_feet_that_stay_on_the_ground_need_not_be_armed():
    step, closes = heel_toe_step(14.0, coordinate=LIMITS), "heel a stick, heel b slip+ > heel a stick |"
    stays = "heel a slip+, heel b stick > heel a slip-, heel b stick >"
    assert "heel b must close" in explain_unreachable_arming(step.replace(sequence=closes))
    assert explain_unreachable_arming(step.replace(sequence=stays)) is None


@pytest.mark.parametrize(
    "step", [heel_toe_step(0.05).replace(sequence=HEEL_STICKS), heel_toe_step(14.0, coordinate=LIMITS)]
)
def test_searches_and_sweeps_state_the_reason_of_a_solve(step):
    reason = explain_planar_impossibility(step)
    (finding,) = search(step, sequences=[step.sequence], starts=1).findings
    assert (finding.status, finding.reason) == ("impossible", reason)
    with pytest.raises(InputError, match=re.escape(f"{reason[0].upper()}{reason[1:]}.")):
        sweep(step, {"speed": [0.6]}, starts=1)


def test_no_remedies_are_tried_for_an_impossible_problem(monkeypatch):
    def refuse(*arguments, **options):
        raise AssertionError

    monkeypatch.setattr(remedy_trials, "solve_from_guess", refuse)
    monkeypatch.setattr(remedy_trials, "find_missing_arming", refuse)
    step = heel_toe_step(0.05).replace(sequence=HEEL_STICKS)
    gait = solve_planar(step)
    assert try_remedies(step, gait) is gait
