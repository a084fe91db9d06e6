"""Trials of the remedies for a failed solve: limits, the order of the contacts of a foot, and the sign of the slope."""

import dataclasses
import math
import re

import pytest

from gaitopt import Status
from gaitopt.cli.remedy_files import describe_changes
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import IMPLAUSIBLE
from gaitopt.motion.gait_table import describe_status
from gaitopt.motion.solve_table import NOT_YET_VERIFIED, list_remarks
from gaitopt.ocp import PlanarLimits, solve_planar
from gaitopt.ocp.multicontact.arming_threshold import find_least_arming, lower_arming_thresholds
from gaitopt.ocp.multicontact.planar_relaxable import replace_limit
from gaitopt.ocp.multicontact.planar_remarks import report_suspects, report_unmet_arming
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.simulation import remedy_trials, verify_planar
from gaitopt.simulation.remedy_trials import try_remedies
from gaitopt.study.storage.failure_reason import explain_failure
from tests.walkers.heel_toe import LIGHT, heel_toe_step

SPEED = Conflict(name="speed", setting="speed", limit=0.9, missing=0.5, sufficient=0.4, unit="m/s", separable=True)
TORQUE = Conflict(
    name="torque limit of motor", setting="PlanarLimits.torque", limit=60.0, missing=10.0, sufficient=70.0,
    unit="N m", separable=True, item="motor",
)  # fmt: skip
TOE_FIRST = "toe a stick | heel a stick |"


@pytest.fixture(scope="module")
def uphill():
    return heel_toe_step(0.05).replace(slope=-0.03)


@pytest.fixture(scope="module")
def failure(uphill):
    """Return a solve that ends after one iteration; its conflicts are stated by each test."""
    gait = solve_planar(uphill, solver=Ipopt(max_iterations=1))
    assert not gait.status.ok
    return gait


def fail(failure, *conflicts):
    return failure.replace_fields(solver=failure.solver.replace_fields(conflicts=conflicts, warnings=()))


@pytest.fixture
def solved(monkeypatch):
    """Return a function that states for which problems a verified gait exists, and the problems that are tried."""

    def state(exists):
        tried = []

        def is_solved(problem, solver, observer, keep):
            tried.append(problem)
            return exists(problem)

        monkeypatch.setattr(remedy_trials, "_is_solved", is_solved)
        return tried

    return state


@pytest.mark.slow
def test_the_first_change_of_a_limit_with_a_verified_gait_is_reported_first(uphill, failure, solved):
    tried = solved(lambda problem: problem.speed < 0.3)
    gait = try_remedies(uphill, fail(failure, TORQUE, SPEED))
    assert [problem.limits.torques(("motor",))[0] for problem in tried[:2]] == pytest.approx([70, 73])
    assert [problem.speed for problem in tried[2:]] == pytest.approx([0.4, 0.25])
    speed, torque = gait.solver.conflicts
    assert (speed.verified, torque.verified) == (True, False)
    assert str(speed) == "speed is 0.9 m/s: 0.25 m/s alone suffices for a verified gait"
    assert str(torque) == (
        "torque limit of motor (PlanarLimits.torque) is 60 N m: 70 N m alone suffices for a motion on a coarse grid, "
        "but no verified gait was found with it"
    )
    assert gait.solver.warnings == ()
    assert ("note", NOT_YET_VERIFIED) not in list_remarks(gait.solver)
    assert ("note", NOT_YET_VERIFIED) in list_remarks(fail(failure, SPEED).solver)


@pytest.mark.slow
def test_without_a_sufficient_limit_the_order_of_the_contacts_and_the_slope_are_tried(uphill, failure, solved):
    solved(lambda problem: problem.slope > 0 or str(problem.sequence).startswith("heel a"))
    gait = try_remedies(uphill.replace(sequence=TOE_FIRST), fail(failure))
    exchanged, downhill = gait.solver.warnings  # and no remark that the sequence itself may be impossible
    assert "with the contacts of each foot exchanged, sequence='heel a stick | toe a stick |'" in exchanged
    assert downhill == "A verified gait was found on the opposite slope, downhill by 0.03 rad (1.71887 deg)."


def test_a_slope_in_rad_instead_of_deg_is_named_if_its_value_in_deg_has_a_gait(uphill, failure, solved):
    nearly_level = uphill.replace(slope=math.radians(0.035))
    solved(lambda problem: problem.slope == pytest.approx(0.035))
    (warning,) = try_remedies(nearly_level, fail(failure)).solver.warnings
    assert warning.startswith("A verified gait was found on the slope of 0.035 rad (2.00535 deg), whose value in rad")
    solved(lambda problem: False)
    (warning,) = try_remedies(nearly_level, fail(failure)).solver.warnings
    assert warning.startswith("No change of a single limit is known to suffice")


def test_a_limit_that_fails_in_the_trial_leaves_the_sequence_as_a_suspect(uphill, failure, solved):
    solved(lambda problem: False)
    assert report_suspects(uphill, [SPEED]) == ()
    gait = try_remedies(uphill, fail(failure, SPEED))
    (suspect,) = gait.solver.warnings
    assert suspect.startswith("No change of a single limit is known to suffice")
    (conflict,) = gait.solver.conflicts
    assert conflict.verified is False


def test_conflicts_that_suffice_only_together_are_not_tried(uphill, failure, solved):
    tried = solved(lambda problem: False)
    both = dataclasses.replace(SPEED, separable=False), dataclasses.replace(TORQUE, sufficient=math.nan)
    assert try_remedies(uphill, fail(failure, *both)).solver.conflicts == both
    assert {problem.speed for problem in tried} == {uphill.speed}


@pytest.mark.parametrize("is_enough", [True, False])
def test_a_lower_threshold_is_reported_first_although_a_limit_suffices(failure, solved, is_enough):
    problem = heel_toe_step(0.6)
    solved(lambda each: each.speed < 0.9 or (is_enough and each.robot is not problem.robot))
    conflict = dataclasses.replace(SPEED, name="condition", setting="Margins.touchdown_armed", sufficient=math.nan)
    stated = fail(failure, SPEED, conflict)
    wrong = report_unmet_arming(problem, stated.solver.conflicts)
    assert wrong
    gait = try_remedies(problem, stated.replace_fields(solver=stated.solver.replace_fields(warnings=wrong)))
    assert gait.solver.conflicts[0].verified is True
    if not is_enough:
        assert gait.solver.warnings == wrong
        return
    (lower,) = gait.solver.warnings
    assert lower.startswith(
        "A verified gait was found with thresholds in `armed` of the contacts that are lower by 0.2"
    )
    stated = re.search(r"lower by (\S+) and no other change: to obtain it, write `armed=\.\.\. \+ (\S+)`", lower)
    assert stated[1] == stated[2] == f"{float(stated[1]):.2g}"
    assert "'toe a' lands while its expression `armed` is -0.2" in lower


def test_thresholds_that_touchdowns_meet_are_not_lowered(uphill, failure, solved):
    problem = heel_toe_step(0.05)
    tried = solved(lambda each: False)
    try_remedies(problem, fail(failure))
    assert all(each.robot is problem.robot for each in tried)


@pytest.mark.parametrize(
    ("found", "remedy"), [("threshold", "`armed=... - 0.11`"), ("speed", "speed = 0.99 m/s"), ("", None)]
)
def test_an_inaccurate_plan_that_lands_too_early_names_a_change_with_a_gait(
    failure, solved, monkeypatch, found, remedy
):
    """Without such a change, and without a touchdown that is too early, the warnings of the solve remain."""
    problem = heel_toe_step(0.05)
    solved(
        lambda each: each.robot is not problem.robot if found == "threshold" else found == "speed" and each.speed > 0.9
    )
    monkeypatch.setattr(remedy_trials, "find_penetrations", lambda *arguments: [1])
    monkeypatch.setattr(remedy_trials, "find_least_arming", lambda *arguments: 0.41)
    gait = try_remedies(problem, fail(failure).replace_fields(status=Status.PLAN_INACCURATE))
    assert len(gait.solver.warnings) == (remedy is not None)
    assert remedy is None or remedy in gait.solver.warnings[0]


def test_the_least_value_of_the_arming_conditions_at_touchdowns_is_that_of_the_motion(failure):
    motion, robot = failure.motion, failure.robot
    ends = [(segment.q[:, -1], segment.v[:, -1]) for segment in motion.segments]
    toe, heel = robot.contact_index("toe a"), robot.contact_index("heel b")
    p = robot.vector(motion.parameters)
    values = [float(robot.arming(*end, p)[i]) for end, i in zip(ends, (toe, heel), strict=True)]
    assert find_least_arming(robot, motion) == pytest.approx(min(values), abs=1e-12)


def test_an_implausible_robot_ends_the_search_for_limits_and_remedies(solved):
    problem = heel_toe_step(0.05, build=LIGHT._replace(heel=-5.0, toe=9.0))
    tried = solved(lambda each: True)
    gait = try_remedies(problem, solve_planar(problem, solver=Ipopt(max_iterations=30)))
    assert not gait.status.ok
    assert tried == []
    assert gait.solver.conflicts == gait.solver.violations == ()
    assert gait.solver.message == IMPLAUSIBLE
    (remark,) = gait.solver.warnings
    assert "If the value is in cm, state 0.14 m." in remark
    assert "see the first warning" in describe_status(gait)
    assert "limits or" not in describe_status(gait)
    assert explain_failure(gait).endswith(remark)


@pytest.mark.slow
def test_actuators_that_are_too_weak_are_named_although_no_limit_is_known_to_suffice(uphill, failure):
    """The conflicts of a far motion do not contain the torque limit, and the sequence is possible."""
    weak = uphill.replace(slope=0.03, limits=PlanarLimits(torque=1.0))
    kept = []
    gait = try_remedies(weak, fail(failure), keep=lambda problem, found: kept.append((problem, found)))
    ((changed, found),) = kept
    assert found.verification.passed
    (change,) = describe_changes(weak, changed)
    assert change.startswith("PlanarLimits.torque = {'motor': ")
    (advice,) = gait.solver.warnings
    assert advice.startswith("A verified gait was found with larger limits in PlanarLimits.torque and no other change")
    peak = float(re.search(r"above the stated limits are (\S+) N m at motor", advice)[1])
    assert 1.0 < peak < 60.0
    strong = verify_planar(solve_planar(weak.replace(limits=PlanarLimits(torque=1.01 * peak))))
    assert strong.verification.passed


def test_actuators_that_are_strong_are_not_tried(uphill):
    assert not list(
        remedy_trials._try_stronger_actuators(uphill.replace(limits=PlanarLimits(torque=1e3)), Ipopt(), None, None)
    )


@pytest.mark.parametrize(
    ("setting", "item", "limit", "value", "read"),
    [
        ("speed", "", 0.9, 0.5, lambda problem: problem.speed),
        ("step_length", "", 0.3, 0.2, lambda problem: problem.step_length[0]),
        ("friction", "", 0.8, 1.2, lambda problem: problem.friction),
        ("PlanarLimits.coordinate", "a", -1, -2, lambda problem: problem.limits.coordinate["a"][0]),
        ("PlanarLimits.coordinate", "a", 1, 2, lambda problem: problem.limits.coordinate["a"][1]),
        ("PlanarLimits.height", "hip", 0.5, 0.4, lambda problem: problem.limits.height["hip"]),
        ("PlanarLimits.rate", "", 9, 10, lambda problem: problem.limits.rate),
        ("Margins.touchdown_rate", "", 0.1, 0.0, lambda problem: problem.margins.touchdown_rate),
    ],
)
def test_each_limit_can_be_replaced(uphill, setting, item, limit, value, read):
    limits = PlanarLimits(coordinate={"a": (-1, 1)}, height={"hip": 0.5}, rate=9)
    problem = uphill.replace(limits=limits, step_length=(0.3, 0.45))
    conflict = dataclasses.replace(SPEED, name="a name in other words", setting=setting, item=item, limit=limit)
    assert read(replace_limit(problem, conflict, value)) == value


def test_a_limit_that_is_no_single_number_is_not_replaced(uphill):
    assert replace_limit(uphill, dataclasses.replace(SPEED, setting="ActuatorImpulse.limits"), 2.0) is None


def test_the_changes_of_a_problem_are_stated(uphill):
    robot = lower_arming_thresholds(uphill.robot, 0.1)
    changed = uphill.replace(robot=robot, slope=0.02, speed=0.3, sequence=TOE_FIRST)
    changes = ["other thresholds in `armed`", "speed = 0.3 m/s", "slope = 0.02 rad", f"sequence = {TOE_FIRST}"]
    assert list(describe_changes(uphill, changed)) == changes
    assert not list(describe_changes(uphill, uphill.replace(name="other")))


@pytest.mark.slow
def test_a_step_that_lands_on_the_toe_is_advised_to_land_on_the_heel():
    problem = heel_toe_step(0.05).replace(sequence=TOE_FIRST)
    gait = try_remedies(problem, solve_planar(problem))
    assert gait.status is Status.INFEASIBLE
    assert not any(conflict.verified for conflict in gait.solver.conflicts)
    assert "each foot exchanged, sequence='heel a stick | toe a stick |'" in gait.solver.warnings[0]


@pytest.mark.slow
def test_a_threshold_that_is_too_high_is_advised_to_be_lowered():
    problem = heel_toe_step(0.6)
    gait = try_remedies(problem, solve_planar(problem))
    assert not gait.status.ok
    assert "thresholds in `armed` of the contacts that are lower by" in gait.solver.warnings[0]
