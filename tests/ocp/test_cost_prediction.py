"""What a gait promises for a problem nearby: its objective to first order."""

from dataclasses import replace

import pytest

from gaitopt import InputError, solve
from gaitopt.ocp.initial.cost_prediction import predict_cost

SEQUENCE = "slip+ stick | slip+"


@pytest.fixture(scope="module")
def problem(reference_problem):
    return reference_problem(sequence=SEQUENCE, objective="torque_squared", speed=0.6, intervals=12)


@pytest.fixture(scope="module")
def gait(problem):
    return solve(problem)


def test_at_its_own_problem_it_is_the_gaits_own(problem, gait):
    assert predict_cost(problem, gait) == pytest.approx(gait.solver.objective, rel=1e-8)


@pytest.mark.parametrize(
    "changed",
    [
        lambda problem, h: problem.replace(friction=0.14 + 1e-3 * h),  # in the constraints
        lambda problem, h: problem.replace(speed=0.6 + 2e-3 * h),  # in the bounds of a constraint
        lambda problem, h: problem.replace(step_length=0.4713 + 1e-3 * h),  # in the bounds of a variable
        lambda problem, h: problem.replace(parameters={**problem.parameters, "hip_mass": 2 + 0.02 * h}),  # everywhere
    ],
    ids=["friction", "speed", "step", "mass"],
)
def test_elsewhere_it_is_right_to_first_order(problem, gait, changed):
    whole, half = (
        solve(there).solver.objective - predict_cost(there, gait)
        for there in (changed(problem, 1), changed(problem, 0.5))
    )
    shift = abs(predict_cost(changed(problem, 1), gait) - gait.solver.objective)
    assert abs(whole) < 0.15 * shift
    assert whole / half == pytest.approx(4, rel=0.25)


def test_a_gait_without_solution_is_refused(problem, gait):
    with pytest.raises(InputError, match="must contain unknowns and Lagrange multipliers, but has none"):
        predict_cost(problem, replace(gait, solution=None))
