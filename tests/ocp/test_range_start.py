"""Second start of a problem with a range of speed or step length whose plan is inaccurate."""

import math

import pytest

from gaitopt import Status
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact.range_start import solve_from_range_ends
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.simulation import verify_planar
from tests.walkers.heel_toe import Build, heel_toe_step

HUMAN_SIZED = Build(22.0, 3.5, 3.5 * 0.9**2 / 14, 0.9, 0.45 * 0.9, -0.05, 0.11, 40.0)


def ranged(**targets):
    problem = heel_toe_step(0.06, build=HUMAN_SIZED)
    return problem.replace(slope=math.radians(2), friction=0.7, **({"speed": 0.8, "step_length": 0.42} | targets))


@pytest.fixture(scope="module")
def plan():
    """Return a plan at 0.8 m/s with steps of 0.42 m, which the tests state to be inaccurate."""
    gait = solve_planar(ranged())
    return gait.replace_fields(status=Status.PLAN_INACCURATE)


@pytest.mark.parametrize(
    ("targets", "expected"),
    [
        ({"speed": (0.4, 0.9)}, [(0.4, 0.42), (0.65, 0.42)]),
        ({"speed": (0.4, 0.9), "step_length": (0.42, 0.5)}, [(0.4, 0.5), (0.65, 0.46)]),
        ({}, []),
        ({"speed": None}, []),
    ],
)
def test_the_ends_away_from_the_plan_and_then_the_middles_are_tried(plan, targets, expected):
    tried = []

    def fail(problem, solver):
        tried.append((problem.speed, problem.step_length))
        return plan

    assert solve_from_range_ends(ranged(**targets), plan, Ipopt(), fail) is plan
    assert [pytest.approx(pair) for pair in expected] == tried


@pytest.mark.parametrize(("improves", "warns"), [(True, False), (False, True)])
def test_the_gait_of_the_range_is_returned_and_otherwise_that_of_the_fixed_value_with_a_warning(plan, improves, warns):
    def solve(problem, solver):
        is_fixed = not isinstance(problem.speed, tuple)
        return plan.replace_fields(status=Status.SOLVED if is_fixed or improves else Status.PLAN_INACCURATE)

    gait = solve_from_range_ends(ranged(speed=(0.4, 0.8)), plan, Ipopt(), solve)
    assert gait.status is Status.SOLVED
    assert "speed = 0.4 m/s" in gait.solver.message
    assert gait.solver.iterations == 3 * plan.solver.iterations
    assert any("it need not be the optimum of the range" in each for each in gait.solver.warnings) is warns


@pytest.mark.parametrize("before", [0, 1])
def test_an_interrupt_ends_the_second_start(plan, before):
    statuses = iter([Status.SOLVED] * before + [Status.INTERRUPTED])

    def solve(problem, solver):
        return plan.replace_fields(status=next(statuses))

    gait = solve_from_range_ends(ranged(speed=(0.4, 0.8)), plan, Ipopt(), solve)
    assert gait.status is Status.INTERRUPTED


@pytest.mark.slow
def test_a_range_of_speed_whose_plan_lands_too_early_has_a_verified_gait():
    """Without the second start, the status is `plan_inaccurate`: the plan at 0.6 m/s touches down too early."""
    gait = solve_planar(ranged(speed=(0.6, 0.8)))
    assert gait.status is Status.SOLVED
    assert gait.speed == pytest.approx(0.6, abs=1e-6)
    assert gait.solver.objective == pytest.approx(214.958, abs=0.01)
    assert "the solve started from the gait with speed = 0.8 m/s" in gait.solver.message
    assert verify_planar(gait).status.ok
