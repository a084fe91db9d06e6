"""Families: the NLP of all gaits and its derivatives, the common parameters, and invalid statements."""

from unittest import mock

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Collocation,
    Family,
    GaitProblem,
    InputError,
    Ipopt,
    Limits,
    StabilityBound,
    Status,
    assess_stability,
    compass_biped,
    load,
    rimless_wheel,
    save,
    solve,
    verify,
)
from gaitopt.design import family_solve, planned_gains, planned_law
from gaitopt.design.family_solve import _join_bounds, _Member, _solve_first
from gaitopt.model.robots.monopod import monopod
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.ocp import PlanarProblem
from gaitopt.ocp.nlp.joint_nlp import JointLayout, join_nlps
from gaitopt.progress import silent

FREE = {"leg_com": (0.4, 1.2), "hip_mass": (1.0, 3.0)}
PROBLEM = GaitProblem(
    robot=compass_biped(),
    sequence="slip+ stick | slip+",
    friction=0.14,
    speed=0.633,
    step_length=0.4713,
    limits=Limits(torque=6),
    objective="torque_squared",
    transcription=Collocation(intervals=20),
    free=FREE,
)
PROBLEMS = [PROBLEM.replace(speed=0.6), PROBLEM.replace(speed=0.65, friction=0.16)]


def differ(one, other):
    """Return the largest difference of two matrices relative to the largest entry."""
    one, other = one.full(), other.full()
    return np.max(np.abs(one - other)) / max(1.0, np.max(np.abs(other)))


@pytest.fixture(scope="module")
def solved():
    """Return a solved family, and how often its gaits were solved one by one with the optimal parameters."""
    with mock.patch.object(family_solve, "_solve_each", wraps=family_solve._solve_each) as each:
        return Family(PROBLEMS, weights=[1, 3]).solve(), each.call_count


@pytest.fixture(scope="module")
def result(solved):
    return solved[0]


def test_gaits_of_the_joint_nlp_are_kept_if_the_parameters_hardly_change(solved):
    result, count = solved
    assert count == 1
    assert all(FREE[name][0] <= value <= FREE[name][1] for name, value in result.design.items())
    assert all(gait.solver.constraint_violation < 1e-7 for gait in result.gaits)


@pytest.mark.parametrize("worst_case", [False, True])
def test_the_derivatives_of_the_joint_nlp_are_those_of_its_functions(worst_case, rng):
    design = {name: PROBLEM.values[name] for name in FREE}
    members = [_Member.of(problem, _solve_first(problem, design, silent)) for problem in PROBLEMS]
    layout = JointLayout(tuple(m.transcription.nlp for m in members), tuple(m.shared for m in members), worst_case)
    nlp = join_nlps(layout)
    x, z = nlp.functions["x"], nlp.functions["p"]
    f, g = nlp.functions["f"], nlp.functions["g"]
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", nlp.n_constraints)
    lagrangian = lam_f * f + ca.dot(lam_g, g)
    expected = ca.Function("expected", [x, z, lam_f, lam_g], [ca.jacobian(g, x), ca.hessian(lagrangian, x)[0]])
    point = layout.gather([member.x for member in members]) + 0.01 * rng.normal(size=layout.n_variables)
    data, multipliers = np.concatenate([*(m.data for m in members), [0.25, 0.75]]), rng.normal(size=nlp.n_constraints)
    jacobian, hessian = expected(point, data, 0.7, multipliers)
    assert differ(nlp.derivatives["jac_g"](point, data)[1], jacobian) < 1e-9
    assert differ(nlp.derivatives["hess_lag"](point, data, 0.7, multipliers), ca.triu(hessian)) < 1e-7
    gradient = ca.Function("gradient", [x, z], [ca.gradient(f, x)])(point, data)
    assert differ(nlp.derivatives["grad_f"](point, data)[1], gradient) < 1e-9


def test_all_gaits_have_the_common_parameters_and_are_replayed(result):
    assert result.status.ok, result.message
    for gait, problem in zip(result.gaits, PROBLEMS, strict=True):
        assert gait.speed == pytest.approx(problem.speed)
        assert {name: gait.motion.parameters[name] for name in FREE} == result.design
        assert verify(gait).verification.passed
    assert result.objective == pytest.approx(0.25 * result.costs[0] + 0.75 * result.costs[1])


def test_the_file_of_a_gait_contains_the_shared_parameters(result, tmp_path):
    gait = load(save(result.gaits[0], tmp_path / "gait.h5"))
    assert gait.design == pytest.approx(result.design)
    assert any(name == "design" and "leg_com" in text for name, text in tabulate_gait(gait))


def test_the_weighted_derivatives_of_the_costs_vanish_inside_the_bounds(result):
    """First-order condition of the common parameters: those of each gait by the envelope theorem."""
    com, mass = (
        sum(w * gait.certificate.derivative_of(name) for w, gait in zip(result.weights, result.gaits, strict=True))
        for name in FREE
    )
    assert 0.4 < result.design["leg_com"] < 1.2
    assert com == pytest.approx(0, abs=1e-4)
    assert result.design["hip_mass"] == pytest.approx(3.0, abs=1e-6)
    assert mass < -0.1


def test_nearby_parameters_cost_more(result):
    for change in (-0.02, 0.02):
        design = result.design | {"leg_com": result.design["leg_com"] + change}
        costs = [solve(problem.fix_parameters(design)).solver.objective for problem in PROBLEMS]
        assert 0.25 * costs[0] + 0.75 * costs[1] > result.objective


def test_the_worst_case_has_the_least_largest_cost(result):
    worst = Family(PROBLEMS, weights=[1, 3], worst_case=True).solve()
    assert worst.status.ok
    largest = max(w * cost for w, cost in zip(result.weights, result.costs, strict=True))
    assert worst.objective < largest
    assert worst.objective == max(w * cost for w, cost in zip(worst.weights, worst.costs, strict=True))


@pytest.mark.slow
def test_a_family_without_a_gait_reports_which_one_failed():
    weak = PROBLEM.replace(limits=Limits(torque=0.1))
    failed = Family([PROBLEM, weak]).solve()
    assert not failed.status.ok
    assert failed.message.startswith("gait 2: ")


def test_gaits_at_two_frictions_share_their_torques():
    problems = [PROBLEM.replace(friction=friction, free={}) for friction in (0.14, 0.16)]
    result = Family(problems, shared="torques").solve()
    assert result.status.ok, result.message
    assert result.design == {}
    assert all(gait.certificate is None for gait in result.gaits)
    for one, other in zip(*(gait.motion.segments for gait in result.gaits), strict=True):
        assert np.array_equal(one.torque, other.torque)
    for gait, problem in zip(result.gaits, problems, strict=True):
        assert gait.motion.parameters["friction"] == problem.friction
        assert verify(gait).verification.passed
        assert solve(problem).solver.objective < gait.solver.objective - 0.3


@pytest.mark.slow
def test_eight_gaits_share_their_torques_if_speed_and_step_length_have_bounds():
    """With values instead of bounds, the conditions of the gaits on the torques nearly contradict each other."""
    bounded = PROBLEM.replace(free={}, speed=(0.628, 0.638), step_length=(0.466, 0.476))
    result = Family([bounded.replace(friction=mu) for mu in np.linspace(0.14, 0.16, 8)], shared="torques").solve()
    assert result.status.ok, result.message
    assert result.iterations < 60
    assert all(0.628 - 1e-6 <= gait.speed <= 0.638 + 1e-6 for gait in result.gaits)


def test_the_message_of_gaits_without_common_torques_advises_bounds():
    exact = [PROBLEM.replace(free={}, friction=mu) for mu in (0.14, 0.16)]
    failed = Family(exact, shared="torques").solve(solver=Ipopt(max_iterations=2))
    assert not failed.status.ok
    assert failed.message.endswith("use bounds such as speed=(0.6267, 0.6393), step_length=(0.4666, 0.476)")


@pytest.mark.slow
def test_gaits_at_two_speeds_share_the_gains_of_their_law():
    bound = StabilityBound(radius=0.5, gain_limit=5)
    base = PROBLEM.replace(sequence="stick | stick", friction=0.2, free={}, stability=bound)
    result = Family([base.replace(speed=speed) for speed in (0.6, 0.65)], shared=["gains"]).solve()
    assert result.status.ok, result.message
    gains = [planned_gains(gait) for gait in result.gaits]
    assert np.array_equal(*gains)
    assert np.max(np.abs(gains[0])) > 0.1
    for gait in result.gaits:
        assert assess_stability(gait, law=planned_law(gait)).radius <= 0.5 + 1e-6


def test_the_bounds_of_shared_torques_are_the_narrowest(result):
    problems = [PROBLEM.replace(limits=Limits(torque=torque)) for torque in (6, 5)]
    members = [_Member.of(one, gait, ["torques"]) for one, gait in zip(problems, result.gaits, strict=True)]
    layout = JointLayout(tuple(m.transcription.nlp for m in members), tuple(m.shared for m in members))
    limits = _join_bounds(layout, members)
    torques = slice(len(FREE), layout.n_shared)
    assert np.all(limits.x_lower[torques] == -5)
    assert np.all(limits.x_upper[torques] == 5)


def test_the_summary_is_plain(result):
    summary = result.summarise()
    assert summary["design"] == result.design
    assert [gait["speed"] for gait in summary["gaits"]] == pytest.approx([0.6, 0.65])


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (([PROBLEM],), "at least two problems, got 1"),
        (([PROBLEM, PROBLEM.replace(free={})],), "must have the same free parameters"),
        (([PROBLEM.replace(free={})] * 2,), "at least one free parameter; problem 1"),
        (([PROBLEM, PROBLEM], [1, -1]), "weights of a Family must be 2 positive numbers"),
        (([PROBLEM, PROBLEM], [1]), "weights of a Family must be 2 positive numbers"),
        (([PROBLEM, rimless_wheel()],), "problem 2 of a Family must be a GaitProblem"),
        (([PROBLEM, PROBLEM.replace(sequence="any | any")],), "A Family"),
        (([PROBLEM] * 2, None, False, "family", "torque"), "no shared quantity 'torque'.*'torques'"),
        (([PROBLEM] * 2, None, False, "family", ["torques"] * 2), "must differ, got 'torques', 'torques'"),
        (([PROBLEM] * 2, None, False, "family", ["gains"]), "gain_limit.*problem 1 has stability=None"),
        (([PROBLEM, PROBLEM.replace(sequence="stick | stick")], None, False, "family", "torques"), "same contact seq"),
    ],
)
def test_invalid_families(arguments, reason):
    with pytest.raises(InputError, match=reason):
        Family(*arguments)


@pytest.mark.parametrize("shared", [(), ("torques",)])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_an_interrupt_of_any_solve_ends_the_family(shared, number):
    """The first two solves are those of the gaits alone, the third is that of all gaits."""
    grid = Collocation(intervals=10, tolerance=np.inf)
    bounds = {"speed": (0.6, 0.65), "step_length": (0.45, 0.5), "transcription": grid}
    family = Family([problem.replace(**bounds) for problem in PROBLEMS], shared=shared)
    starts = []

    def interrupt(iteration):
        starts.extend([iteration] if iteration.number == 0 else [])
        if len(starts) == number:
            raise KeyboardInterrupt

    result = family.solve(observer=interrupt)
    assert result.status is Status.INTERRUPTED
    assert len(starts) == number
    assert len(result.gaits) == 2


def test_a_family_refers_problems_of_several_contacts_to_their_free_parameters():
    problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6)
    with pytest.raises(InputError, match=r"problem 2 is a PlanarProblem\. .*free=\{\.\.\.\} of one PlanarProblem"):
        Family(problems=(PROBLEM, problem))
