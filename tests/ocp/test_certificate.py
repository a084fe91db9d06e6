"""Certificates of gaits: verdicts, and sensitivities against the costs of solved neighbouring problems."""

import attrs
import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, InputError, Limits, WarmStart, compass_biped, load, save, solve, verify
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.summary import summarise
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.solution.sensitivity import list_numbers

REFERENCE = GaitProblem(
    robot=compass_biped(),
    sequence="stick | stick",
    friction=0.14,
    speed=0.633,
    step_length=0.4713,
    limits=Limits(torque=6),
    objective="torque_squared",
    transcription=Collocation(intervals=40),
)


@pytest.fixture(scope="module")
def smooth():
    return solve(REFERENCE)


@pytest.fixture(scope="module")
def switching():
    return solve(REFERENCE.replace(sequence="slip+ stick | slip+", objective="cost_of_transport"))


def test_a_smooth_optimum_is_a_strict_minimum(smooth):
    certificate = smooth.certificate
    assert (certificate.verdict, certificate.dependent, certificate.weak) == ("strict", 0, 0)
    assert certificate.curvature > 1e-4
    assert "positive definite" in certificate.sentence


def test_an_optimum_that_switches_torques_is_sharp(switching):
    """Its torques are at their limits, at zero, or determined by the other constraints."""
    certificate = switching.certificate
    assert certificate.verdict in ("sharp", "strict")
    assert certificate.strict
    assert certificate.nearest
    assert all(near.distance > 0 for near in certificate.nearest)


def test_a_certificate_that_is_begun_in_advance_is_the_same(switching):
    """The linear program of the check may be solved in another thread while the gait is replayed."""
    again = solve(REFERENCE.replace(sequence="slip+ stick | slip+", objective="cost_of_transport"))
    again.begin_evaluation("certificate")
    again.begin_evaluation("certificate")
    # As texts, because the curvature of a sharp minimum is nan.
    assert str(verify(again).certificate) == str(switching.certificate)


@pytest.mark.parametrize("name", ["friction", "speed", "leg_length", "leg_com", "torque_limit of hip", "cone_margin"])
def test_sensitivities_are_derivatives_of_solved_problems(smooth, name):
    """Five-digit agreement with central differences of solved problems whose numbers differ by 1e-4 of their value."""
    number = next(number for number in list_numbers(REFERENCE) if number.name == name)
    step = 1e-4 * number.value
    solver = Ipopt(tolerance=1e-11)
    ends = [number.change(number.value + side * step).replace(guess=WarmStart(smooth)) for side in (1, -1)]
    up, down = (solve(problem, solver=solver).solver.objective for problem in ends)
    expected = (up - down) / (2 * step)
    effects = {one.name: one.derivative for one in smooth.certificate.sensitivities}
    assert effects.get(name, 0.0) == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_all_numbers_of_a_problem_can_be_changed():
    problem = REFERENCE.replace(limits=Limits(torque={"ankle": 6, "hip": 5}, torque_rate=400, clearance=0.0))
    numbers = {number.name: number for number in list_numbers(problem)}
    changed = numbers["torque_limit of hip"].change(4.0)
    assert changed.limits.torques(problem.robot.actuators) == [6.0, 4.0]
    assert numbers["lower angle_limit of th1"].change(-1.0).limits.angles(problem.robot.angles)[0] == (-1.0, np.pi / 2)
    assert {"torque_rate_limit of ankle", "clearance", "shortest_phase", "longest_step", "gravity"} <= set(numbers)
    assert numbers["cone_margin"].change(0.01).margins == attrs.evolve(problem.margins, cone=0.01)


def test_the_derivative_of_an_unknown_number_is_refused(smooth):
    with pytest.raises(InputError, match=r"does not depend on 'frictoin'.*friction"):
        smooth.certificate.derivative_of("frictoin")


def test_a_certificate_is_in_file_and_json(smooth, tmp_path):
    again = load(save(smooth, tmp_path / "gait.h5"))
    assert again.certificate == smooth.certificate
    assert summarise(again)["certificate"]["sensitivities"][0]["name"] == "step_length"


def test_a_gait_that_is_not_solved_has_none():
    assert solve(REFERENCE.replace(limits=Limits(torque=0.1))).certificate is None


def test_the_table_of_a_gait_without_cost_has_no_relative_sensitivities(smooth):
    assert "sensitivity" in dict(tabulate_gait(smooth))
    free = smooth.replace_fields(solver=smooth.solver.replace_fields(objective=0.0))
    assert "sensitivity" not in dict(tabulate_gait(free))


def test_large_relative_sensitivities_have_no_exponent(smooth):
    solver = smooth.solver
    cheap = smooth.replace_fields(solver=solver.replace_fields(objective=1e-4 * solver.objective))
    (first, *_) = smooth.certificate.sensitivities
    percent = 100 * first.change(0.01) / cheap.solver.objective
    assert abs(percent) > 100
    assert f"{first.name} {float(f'{percent:.2g}'):+.0f} %" in dict(tabulate_gait(cheap))["sensitivity"]
