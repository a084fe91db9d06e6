"""Problems of robots with several contacts whose parameters are free, and certificates of their gaits."""

import itertools

import attrs
import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, InputError, Limits, Status, compass_biped, load, save, solve, verify
from gaitopt.cli.script import call_script
from gaitopt.model import compass_with_two_feet, monopod
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.summary import summarise
from gaitopt.ocp import FromPlanarGait, PlanarLimits, PlanarProblem, solve_planar
from gaitopt.ocp.multicontact import planar_infeasibility
from gaitopt.ocp.multicontact.planar_certification import list_planar_numbers
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.progress import silent
from tests.conftest import ROOT

FREE = {"leg_com": (0.4, 1.2), "hip_mass": (1.0, 3.0)}
PROBLEM = PlanarProblem(
    robot=compass_with_two_feet(),
    sequence="foot A stick |",
    friction=1.0,
    speed=0.633,
    step_length=0.4713,
    objective="torque_squared",
    limits=PlanarLimits(torque={"ankle B": 0}),
    transcription=Collocation(intervals=10),
    free=FREE,
)
HOP = PlanarProblem(
    robot=monopod(),
    sequence="foot stick > flight |",
    friction=1.0,
    speed=1.5,
    step_length=0.6,
    objective="torque_squared",
    limits=PlanarLimits(coordinate={"s": (0.35, 0.65)}, clearance=0.01),
    transcription=Collocation(intervals=(8, 12), tolerance=np.inf),
)


@pytest.fixture(scope="module")
def gait():
    return verify(solve(PROBLEM))


@pytest.fixture(scope="module")
def hopping():
    return solve_planar(HOP)


def differences(problem, gait, name):
    """Return the derivative of the optimal cost by a central difference with steps of 1e-4 of the value."""
    number = next(number for number in list_planar_numbers(problem) if number.name == name)
    step, solver = 1e-4 * number.value, Ipopt(tolerance=1e-9)
    ends = [number.change(number.value + side * step).replace(guess=FromPlanarGait(gait)) for side in (1, -1)]
    up, down = (solve_planar(problem, solver=solver).solver.objective for problem in ends)
    return (up - down) / (2 * step)


def test_the_replay_has_the_optimised_parameters(gait):
    assert gait.verification.passed
    assert gait.design == {name: gait.motion.parameters[name] for name in FREE}
    assert gait.design["hip_mass"] == 3.0  # a heavy hip is of advantage, and values never exceed their bounds
    assert 0.5 < gait.design["leg_com"] < 1.1


@pytest.mark.slow
def test_no_fixed_design_has_a_lower_cost(gait):
    costs = [
        solve(PROBLEM.fix_parameters({"leg_com": com, "hip_mass": mass})).solver.objective
        for com, mass in itertools.product((0.4, 0.8, 1.2), (1.0, 3.0))
    ]
    assert gait.solver.objective <= min(costs) * (1 + 1e-7)
    same = solve(PROBLEM.fix_parameters(gait.design))
    assert same.solver.objective == pytest.approx(gait.solver.objective, rel=1e-8)


def test_design_and_sensitivities_are_those_of_the_problem_with_one_foot_on_the_ground(gait):
    """The same optimum from other coordinates, equations and constraints."""
    other = solve(
        GaitProblem(
            robot=compass_biped(),
            sequence="stick | stick",
            friction=1.0,
            speed=0.633,
            step_length=0.4713,
            objective="torque_squared",
            transcription=Collocation(intervals=20),
            free=FREE,
            limits=Limits(torque=100),
        )
    )
    assert gait.design == pytest.approx(other.design, rel=1e-4)
    assert gait.certificate.verdict == other.certificate.verdict == "strict"
    for name in ("step_length", "speed", "leg_length", "leg_mass", "gravity", "upper bound of hip_mass", "slope"):
        expected = other.certificate.derivative_of(name)
        assert gait.certificate.derivative_of(name) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("name", ["upper bound of hip_mass", "leg_length", "gravity", "speed"])
def test_sensitivities_are_derivatives_of_solved_problems(gait, name):
    expected = differences(PROBLEM, gait, name)
    assert gait.certificate.derivative_of(name) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("name", ["friction", pytest.param("foot_mass", marks=pytest.mark.slow)])
def test_sensitivities_of_a_hop_are_derivatives_of_solved_problems(hopping, name):
    expected = differences(HOP, hopping, name)
    assert hopping.certificate.derivative_of(name) == pytest.approx(expected, rel=1e-4)


def test_a_failure_is_examined_with_the_parameters_of_the_start(gait, monkeypatch):
    examined = []
    monkeypatch.setattr(
        planar_infeasibility,
        "conclude_planar_failure",
        lambda problem, failure, *_: examined.append(problem) or failure,
    )
    problem = PROBLEM.replace(guess=FromPlanarGait(gait))
    failure = gait.replace_fields(status=Status.INFEASIBLE)
    conclude = planar_infeasibility._conclude_with_fixed_parameters
    assert conclude(problem, failure, Ipopt(), silent, solve) is failure
    assert {name: examined[0].values[name] for name in FREE} == gait.design
    assert not examined[0].free


def test_bounds_of_speed_and_step_length_have_sensitivities():
    problem = PROBLEM.replace(free={}, speed=(0.5, 0.8), step_length=(0.35, 0.45))
    gait = solve(problem)
    for name in ("lower bound of speed", "lower bound of step_length"):
        assert gait.certificate.derivative_of(name) == pytest.approx(differences(problem, gait, name), rel=1e-4)
    with pytest.raises(InputError, match="does not depend on 'upper bound of speed'"):
        gait.certificate.derivative_of("upper bound of speed")


@pytest.mark.slow
def test_sensitivities_of_a_double_support_with_slip_are_derivatives_of_solved_problems():
    """The trailing foot slips forward while the other sticks; friction acts on both."""
    problem = call_script(ROOT / "problems" / "compass_double_support.py", [])
    problem = problem.replace(transcription=attrs.evolve(problem.transcription, tolerance=np.inf))
    gait = solve_planar(problem)
    assert gait.certificate.verdict == "strict"
    for name in ("friction", "hip_mass"):
        expected = differences(problem, gait, name)
        assert gait.certificate.derivative_of(name) == pytest.approx(expected, rel=1e-4)


def test_a_coordinate_without_effect_leaves_an_optimum_flat(hopping):
    """The angle of the monopod's body occurs in its equations only as a rate, so that its mean is arbitrary."""
    certificate = hopping.certificate
    assert (certificate.verdict, certificate.dependent) == ("undecided", 0)
    assert certificate.curvature == pytest.approx(0, abs=1e-9)
    assert not certificate.strict


def test_the_design_and_the_certificate_are_in_file_table_and_json(gait, tmp_path):
    again = load(save(gait, tmp_path / "gait.h5"))
    assert again.problem["free"] == {"leg_com": [0.4, 1.2], "hip_mass": [1.0, 3.0]}
    assert again.certificate == gait.certificate
    assert verify(again).verification.passed
    summary = summarise(again)
    assert summary["design"] == gait.design
    assert summary["certificate"]["sensitivities"][0]["name"] == "step_length"
    table = dict(tabulate_gait(again))
    assert table["design"].endswith("hip_mass 3 (1 to 3) [SI units, rad]")
    assert table["optimum"].startswith("strict local minimum")
    assert "also over" in str(PROBLEM)


def test_free_speed_and_ground_are_optimised_as_well():
    problem = PROBLEM.replace(speed=None, free={"speed": (0.6, 0.7), "slope": (0.0, 0.02)})
    assert problem.speed == (0.6, 0.7)
    gait = solve_planar(problem)
    assert gait.status.ok
    assert 0.6 < gait.speed < 0.7
    assert 0.0 < gait.design["slope"] < 0.02
    assert gait.solver.objective < 1e-6  # the passive gait, which needs no torque


@pytest.mark.slow
def test_a_conflict_with_a_free_friction_coefficient_states_a_sufficient_bound():
    limits = PlanarLimits(torque={"ankle A": 6, "ankle B": 0, "hip": 6})
    problem = PROBLEM.replace(limits=limits, friction=0.03, free={"friction": (0.02, 0.04)})
    failure = solve_planar(problem)
    assert failure.status is Status.INFEASIBLE
    (conflict,) = (each for each in failure.solver.conflicts if each.name == "friction")
    assert (conflict.setting, conflict.limit) == ("free", 0.04)
    assert solve_planar(problem.replace(free={"friction": (0.02, conflict.sufficient)})).status.ok


def test_whole_numbers_as_targets_have_sensitivities():
    problem = PROBLEM.replace(speed=1, step_length=[1, 2], free={})
    assert (problem.speed, problem.step_length) == (1.0, (1.0, 2.0))
    names = {number.name for number in list_planar_numbers(problem)}
    assert {"speed", "lower bound of step_length", "upper bound of step_length"} <= names


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ({"leg_mas": (1, 2)}, "leg_mass"),
        ({"leg_mass": (2, 1)}, "lower below the upper"),
        ([("leg_mass", 1, 2)], "free must be a mapping"),
    ],
)
def test_invalid_bounds_are_refused(free, message):
    with pytest.raises(InputError, match=message):
        PROBLEM.replace(free=free)


@pytest.mark.slow
def test_an_infeasible_problem_reports_the_conflict_with_the_parameters_at_their_start():
    limits = PlanarLimits(torque={"ankle B": 0, "ankle A": 0.2, "hip": 0.5})
    failure = solve(PROBLEM.replace(limits=limits, slope=-0.1, free={"hip_mass": (1, 2)}))
    assert failure.status is Status.INFEASIBLE
    assert failure.solver.message.endswith("with the free parameters at their initial values")
    assert [conflict.name for conflict in failure.solver.conflicts] == ["torque limit of ankle A"]
