"""Trials of the remedies for a failed solve: limits, the order of the contacts of a foot, and the sign of the slope."""

import dataclasses
import math

import pytest

from gaitopt import Status
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait_table import NOT_YET_VERIFIED, list_remarks
from gaitopt.ocp import PlanarLimits, solve_planar
from gaitopt.ocp.multicontact.planar_relaxable import replace_limit
from gaitopt.ocp.multicontact.planar_remarks import report_suspects
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.simulation import remedy_trials
from gaitopt.simulation.remedy_trials import try_remedies
from tests.walkers.heel_toe import heel_toe_step

SPEED = Conflict(name="speed", setting="speed", limit=0.9, missing=0.5, sufficient=0.4, unit="m/s", separable=True)
TORQUE = Conflict(
    name="torque limit of motor", setting="PlanarLimits.torque", limit=60.0, missing=10.0, sufficient=70.0,
    unit="N m", separable=True,
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

        def is_solved(problem, solver, observer):
            tried.append(problem)
            return exists(problem)

        monkeypatch.setattr(remedy_trials, "_is_solved", is_solved)
        return tried

    return state


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


def test_without_a_sufficient_limit_the_order_of_the_contacts_and_the_slope_are_tried(uphill, failure, solved):
    solved(lambda problem: problem.slope > 0 or str(problem.sequence).startswith("heel a"))
    gait = try_remedies(uphill.replace(sequence=TOE_FIRST), fail(failure))
    exchanged, downhill, suspect = gait.solver.warnings
    assert suspect.startswith(f"No change of a single limit is known to suffice: the contact sequence '{TOE_FIRST}'")
    assert "The slope of -0.03 rad (-1.71887 deg) is uphill; a positive slope is downhill." in suspect
    assert "with the contacts of each foot exchanged, sequence='heel a stick | toe a stick |'" in exchanged
    assert downhill == "A verified gait was found on the opposite slope, downhill by 0.03 rad (1.71887 deg)."


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


@pytest.mark.parametrize(
    ("name", "setting", "limit", "value", "read"),
    [
        ("speed", "speed", 0.9, 0.5, lambda problem: problem.speed),
        ("step length", "step_length", 0.3, 0.2, lambda problem: problem.step_length[0]),
        ("friction", "friction", 0.8, 1.2, lambda problem: problem.friction),
        ("lower limit of coordinate a", "PlanarLimits.coordinate", -1, -2, lambda p: p.limits.coordinate["a"][0]),
        ("upper limit of coordinate a", "PlanarLimits.coordinate", 1, 2, lambda p: p.limits.coordinate["a"][1]),
        ("height of hip", "PlanarLimits.height", 0.5, 0.4, lambda problem: problem.limits.height["hip"]),
        ("limit of the rates", "PlanarLimits.rate", 9, 10, lambda problem: problem.limits.rate),
        ("approach speed of touchdown", "Margins.touchdown_rate", 0.1, 0.0, lambda p: p.margins.touchdown_rate),
    ],
)
def test_each_limit_can_be_replaced(uphill, name, setting, limit, value, read):
    limits = PlanarLimits(coordinate={"a": (-1, 1)}, height={"hip": 0.5}, rate=9)
    problem = uphill.replace(limits=limits, step_length=(0.3, 0.45))
    assert read(replace_limit(problem, name, setting, limit, value)) == value


def test_a_limit_that_is_no_single_number_is_not_replaced(uphill):
    assert replace_limit(uphill, "limit of the impulse of motor", "ActuatorImpulse.limits", 1.0, 2.0) is None


@pytest.mark.slow
def test_a_step_that_lands_on_the_toe_is_advised_to_land_on_the_heel():
    problem = heel_toe_step(0.05).replace(sequence=TOE_FIRST)
    gait = try_remedies(problem, solve_planar(problem))
    assert gait.status is Status.INFEASIBLE
    assert not any(conflict.verified for conflict in gait.solver.conflicts)
    assert "each foot exchanged, sequence='heel a stick | toe a stick |'" in gait.solver.warnings[0]
