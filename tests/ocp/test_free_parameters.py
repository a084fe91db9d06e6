"""Problems with free parameters: the optimum over gait and design, its record, and its derivatives."""

import itertools

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    Status,
    WarmStart,
    compass_biped,
    load,
    save,
    solve,
    verify,
)
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.summary import summarise
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.solution.sensitivity import list_numbers
from gaitopt.study.sweeps.sweep import sweep

FREE = {"leg_com": (0.4, 1.2), "hip_mass": (1.0, 3.0)}
PROBLEM = GaitProblem(
    robot=compass_biped(),
    sequence="slip+ stick | slip+",
    friction=0.14,
    speed=0.633,
    step_length=0.4713,
    limits=Limits(torque=6),
    objective="torque_squared",
    transcription=Collocation(intervals=40),
    free=FREE,
)


def at(problem, design):
    """Return a problem with the free parameters fixed."""
    friction = design.pop("friction", problem.friction)
    return problem.replace(free={}, parameters={**problem.parameters, **design}, friction=friction)


@pytest.fixture(scope="module")
def gait():
    return verify(solve(PROBLEM))


def test_the_replay_has_the_optimised_parameters(gait):
    assert gait.verification.passed
    assert gait.design == {name: gait.motion.parameters[name] for name in FREE}
    assert all(lower <= gait.design[name] <= upper for name, (lower, upper) in FREE.items())
    assert gait.design["hip_mass"] == 3.0  # a heavy hip is of advantage, and values never exceed their bounds
    assert 0.5 < gait.design["leg_com"] < 1.1


def test_no_fixed_design_has_a_lower_cost(gait):
    """The optimum is at most the cost of each design of a grid, and equals that of its design."""
    costs = [
        solve(at(PROBLEM, {"leg_com": com, "hip_mass": mass})).solver.objective
        for com, mass in itertools.product(np.linspace(0.4, 1.2, 5), (1.0, 3.0))
    ]
    assert gait.solver.objective <= min(costs) * (1 + 1e-7)
    same = solve(at(PROBLEM, dict(gait.design)))
    assert same.solver.objective == pytest.approx(gait.solver.objective, rel=1e-8)


def test_the_design_is_in_file_table_and_json(gait, tmp_path):
    again = load(save(gait, tmp_path / "gait.h5"))
    assert again.design == gait.design
    assert again.problem["free"] == {"leg_com": [0.4, 1.2], "hip_mass": [1.0, 3.0]}
    assert verify(again).verification.passed
    assert summarise(again)["design"] == gait.design
    assert dict(tabulate_gait(again))["design"].endswith("hip_mass 3 (1 to 3) [SI units, rad]")


def test_a_gait_of_an_older_file_has_no_design(slip_gait):
    assert slip_gait.design == {}
    assert "design" not in dict(tabulate_gait(slip_gait))


@pytest.mark.parametrize("name", ["upper bound of hip_mass", "leg_length", "leg_mass", "friction", "speed", "gravity"])
def test_derivatives_of_the_cost_are_those_of_solved_problems(gait, name):
    """The design follows each change; central differences with steps of 1e-4 of the value."""
    number = next(number for number in list_numbers(PROBLEM) if number.name == name)
    step, solver = 1e-4 * number.value, Ipopt(tolerance=1e-11)
    ends = [number.change(number.value + side * step).replace(guess=WarmStart(gait)) for side in (1, -1)]
    up, down = (solve(problem, solver=solver).solver.objective for problem in ends)
    assert gait.certificate.derivative_of(name) == pytest.approx((up - down) / (2 * step), rel=1e-4, abs=1e-6)


def test_the_numbers_of_a_free_parameter_are_its_bounds():
    names = [number.name for number in list_numbers(PROBLEM.replace(free={**FREE, "slope": (-0.01, 0.01)}))]
    assert {"lower bound of leg_com", "upper bound of slope"} <= set(names)
    assert not {"leg_com", "hip_mass", "slope"} & set(names)


def test_friction_and_slope_may_be_free():
    problem = PROBLEM.replace(free={"friction": (0.12, 0.2), "slope": (0.0, 0.01)}, friction=0.3)
    assert problem.values["friction"] == 0.2
    gait = verify(solve(problem))
    assert gait.verification.passed
    assert gait.design["slope"] == pytest.approx(0.01, abs=1e-6)
    nearby = [solve(problem.replace(free={}, friction=friction, slope=0.01)) for friction in (0.15, 0.19)]
    assert gait.solver.objective < min(other.solver.objective for other in nearby)


def test_a_conflict_with_a_free_friction_coefficient_states_a_sufficient_bound():
    problem = PROBLEM.replace(sequence="stick | stick", friction=0.03, free={"friction": (0.02, 0.04)})
    problem = problem.replace(transcription=Collocation(intervals=20))
    failure = solve(problem)
    assert failure.status is Status.INFEASIBLE
    (conflict,) = (each for each in failure.solver.conflicts if each.name == "friction")
    assert (conflict.setting, conflict.limit) == ("free", 0.04)
    assert solve(problem.replace(free={"friction": (0.02, conflict.sufficient)})).status.ok


def test_speed_and_step_length_in_free_are_pairs_of_their_fields():
    problem = PROBLEM.replace(speed=None, free={"speed": (0.5, 0.7), "step_length": [0.4, 0.5]})
    assert (problem.speed, problem.step_length, problem.free) == ((0.5, 0.7), (0.4, 0.5), {})


def test_parameters_start_from_the_value_of_the_problem_or_of_the_gait_it_continues(gait):
    assert PROBLEM.replace(parameters={"leg_com": 1.5}).values["leg_com"] == 1.2
    again = solve(PROBLEM.replace(guess=WarmStart(gait)))
    assert again.solver.iterations < gait.solver.iterations / 2
    assert again.solver.objective == pytest.approx(gait.solver.objective, rel=1e-8)


def test_a_step_is_possible_if_some_design_reaches_it():
    legs = {"leg_length": (1.0, 4.0), "hip_mass": (1.0, 3.0)}
    assert PROBLEM.replace(step_length=4.0, free=legs, speed=None).step_length == 4.0


@pytest.mark.parametrize(
    ("free", "reason"),
    [
        ({"leg_co": (0.4, 1.2)}, "has no parameter 'leg_co'. Did you mean 'leg_com'"),
        ({"leg_com": 0.4}, r"leg_com must have two bounds \(lower, upper\) \[m\], got 0.4"),
        ({"leg_com": (1.2, 0.4)}, "the lower below the upper"),
        ({"leg_com": (0.4, 0.4)}, "the lower below the upper"),
        ({"leg_com": (-0.4, 0.4)}, "leg_com must be at least 0"),
        ({"hip_mass": (0.0, np.inf)}, "hip_mass must be"),
        ({"friction": (0.1, np.inf)}, "friction must have finite bounds"),
        ({"leg_com": (0.4, 1.7)}, "leg_com must be at most leg_length .* 1.7 exceeds 1.6"),
        ({"leg_length": (0.5, 1.7)}, "leg_com must be at most leg_length .* 0.8 exceeds 0.5"),
        (("leg_com",), "free must be a mapping"),
    ],
)
def test_invalid_bounds(free, reason):
    with pytest.raises(InputError, match=reason):
        PROBLEM.replace(free=free)


def test_a_sweep_over_a_free_parameter_is_refused():
    with pytest.raises(InputError, match="A sweep over 'leg_com' needs a problem in which it is not free"):
        sweep(PROBLEM, {"leg_com": [0.5, 0.6]})
