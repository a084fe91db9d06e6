"""verify fails where the leg exchange moves the robot, or the landing foot comes up through the ground."""

import re

import casadi as ca
import pytest

from gaitopt import GaitProblem, InputError, Limits, Newton, Status, solve, verify
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.progress import silent
from tests.walkers import round_compass, torso_biped

WRONG = {
    "torso mirrored": (
        torso_biped(relabel=lambda a, b, t: [-b, -a, -t]),
        r"leg exchange changes the kinetic energy by -?\d.* J",
    ),
    "legs not exchanged": (torso_biped(relabel=lambda a, b, t: [b, a, t]), "leg exchange changes the kinetic energy"),
    "guard of the wrong sign": (
        torso_biped(touchdown=lambda a, b: a - b),
        "landing foot does not approach the ground from above",
    ),
}


def problem(robot):
    return GaitProblem(
        robot=robot,
        sequence="stick | stick",
        friction=0.6,
        speed=0.7,
        step_length=0.4,
        limits=Limits(torque=60),
        objective="torque_squared",
    )


@pytest.mark.parametrize(("robot", "reason"), WRONG.values(), ids=WRONG.keys())
def test_the_gait_of_a_wrong_robot_is_refused_and_not_verified(robot, reason):
    """All three once were 'solved' and 'verified'."""
    posed = problem(robot)
    with pytest.raises(InputError, match=r"Robot 'torso_biped': (the leg exchange|touchdown)"):
        solve(posed)
    gait = solve_from_start(posed, LinearGuess(), Newton(), silent)
    assert gait.status is Status.SOLVED
    verified = verify(gait)
    assert verified.status is Status.NOT_VERIFIED
    assert any(re.search(reason, told) for told in verified.verification.reasons)


def test_a_guard_written_as_the_foots_height_gives_the_same_gait():
    height = torso_biped(touchdown=lambda a, b: ca.cos(a) - ca.cos(b), armed=lambda a, b: ca.sin(a) + ca.sin(b) - 0.1)
    right, other = (verify(solve(problem(robot))) for robot in (torso_biped(), height))
    assert other.verification.passed
    assert other.solver.objective == pytest.approx(right.solver.objective, rel=1e-9)


def test_a_gait_on_round_feet_is_verified():
    robot = round_compass(0.3)
    gait = verify(solve(problem(robot)))
    assert gait.verification.passed, gait.verification.reasons
