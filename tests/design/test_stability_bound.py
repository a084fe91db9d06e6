"""Bounds of the spectral radius: the derivative of the return map in the NLP, and its multipliers in the simulator."""

import casadi as ca
import numpy as np
import pytest
import scipy

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    MultipleShooting,
    StabilityBound,
    WarmStart,
    assess_stability,
    compass_biped,
    feedforward,
    load,
    save,
    solve,
    verify,
)
from gaitopt.design import planned_gains, planned_law
from gaitopt.ocp import solver
from gaitopt.ocp.bounds import nlp_data, transcribe_problem
from gaitopt.ocp.initial.deviation_start import solve_deviations, spectral_radius
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.solution import infeasibility
from gaitopt.ocp.solution.radius_conflict import report_radius_conflict
from gaitopt.ocp.transcription.deviations import section_names
from gaitopt.ocp.transcription.radius_condition import MARGIN, characteristic_coefficients, jury_conditions
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.status import Status

PROBLEM = GaitProblem(
    robot=compass_biped(),
    sequence="stick | stick",
    friction=0.14,
    speed=0.633,
    step_length=0.4713,
    limits=Limits(torque=6),
    objective="torque_squared",
    transcription=Collocation(intervals=40),
)
SLIPPING = PROBLEM.replace(sequence="slip+ stick | slip+")


@pytest.fixture(scope="module")
def bounded():
    return verify(solve(PROBLEM.replace(stability=StabilityBound(radius=0.5))))


def replayed_multipliers(gait, law, step=1e-5):
    """Return the moduli of the multipliers by extrapolated central differences of the simulated return map.

    Its second derivative is not continuous, because the torque is constant after the planned touchdown: the error of a
    central difference is linear in the step.
    """
    walker = make_walker(gait.robot, law, gait.motion.parameters, period=gait.period)
    first = gait.motion.segments[0]
    section = Section(gait.robot, walker.p, sliding=gait.sequence.impact.slips)
    return_map, z = ReturnMap(walker, section), section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))

    def difference(h):
        ends = [(return_map(z + h * unit).end, return_map(z - h * unit).end) for unit in np.eye(z.size)]
        return np.column_stack([(after - before) / (2 * h) for after, before in ends])

    return np.abs(np.linalg.eigvals(2 * difference(step / 2) - difference(step)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sequence", "friction"),
    [("stick | stick", 0.14), ("slip+ stick | slip+", 0.14), ("stick slip- | stick", 0.125)],
)
def test_the_derivative_in_the_nlp_is_that_of_the_simulator(sequence, friction):
    """All events: an impact that sticks or slips, a foot that comes to rest, and a slip that begins."""
    problem = PROBLEM.replace(sequence=sequence, friction=friction, objective="cost_of_transport")
    gait = solve(problem)
    assert gait.status.ok
    problem = problem.replace(stability=StabilityBound(radius=0.9))
    transcription = transcribe_problem(problem, problem.transcription)
    x = transfer_solution(gait.solution, transcription, np.zeros(transcription.variables.size))[0]
    x = solve_deviations(transcription, x, nlp_data(transcription, problem, x))
    section, cycle = section_names(problem.robot, problem.sequence), assess_stability(gait)
    after = x[transcription.variables[Unknown.RETURN][:, 0]].reshape(len(section.names), -1).T[section.kept]
    assert after == pytest.approx(cycle.derivative, abs=1e-5 * np.max(np.abs(cycle.derivative)))
    assert spectral_radius(transcription, x) == pytest.approx(cycle.radius, abs=1e-6)


@pytest.mark.slow
def test_a_bound_far_from_the_radius_of_the_optimum_is_approached_in_steps():
    """The optimum with free masses has a radius of 1.49, and a solve that starts from it ends infeasible."""
    free = {"leg_com": (0.4, 1.2), "hip_mass": (1.0, 3.0)}
    problem = SLIPPING.replace(objective="cost_of_transport", free=free, stability=StabilityBound(radius=0.62))
    gait = solve(problem)
    assert gait.status.ok, gait.solver.message
    assert assess_stability(gait).radius <= 0.62 + 1e-6
    assert gait.cost_of_transport == pytest.approx(0.01239, rel=1e-3)  # own value


def test_an_interrupt_of_the_approach_ends_the_solve(monkeypatch):
    problem = SLIPPING.replace(transcription=Collocation(intervals=10))
    gait = solve(problem)
    problem = problem.replace(stability=StabilityBound(radius=0.2), guess=WarmStart(gait))
    failure = gait.with_failure(Status.INFEASIBLE, "stopped")
    monkeypatch.setattr(solver, "solve_from_starts", lambda *_, **__: [failure])
    monkeypatch.setattr(infeasibility, "conclude_failure", lambda *_: pytest.fail("the solve continues"))

    def interrupt(_):
        raise KeyboardInterrupt

    interrupted = solve(problem, observer=interrupt)
    assert interrupted.status is Status.INTERRUPTED
    assert interrupted.solver.message == "User_Requested_Stop"


def test_an_infeasible_bound_is_named_with_the_radius_of_the_optimum_without_it():
    problem = SLIPPING.replace(transcription=Collocation(intervals=10))
    gait = solve(problem)
    failure = gait.with_failure(Status.ITERATION_LIMIT, "stopped")
    problem = problem.replace(stability=StabilityBound(radius=0.2))
    (conflict,) = report_radius_conflict(problem, failure, gait).solver.conflicts
    radius = assess_stability(gait).radius
    assert conflict.setting == "StabilityBound.radius"
    assert conflict.limit == 0.2
    assert radius < conflict.sufficient < radius + 0.05 * (radius - 0.2)
    loose = problem.replace(stability=StabilityBound(radius=1.0))
    assert report_radius_conflict(loose, failure, gait) is failure


@pytest.mark.slow
def test_a_bound_of_the_radius_is_added_to_the_conflicts_found_without_it():
    """Without the bound, 1.46 m/s, a leg centre of mass of 1.12 m or 16.6 N m at the hip would suffice."""
    problem = PROBLEM.replace(
        free={"leg_com": (0.736, 1.036), "hip_mass": (1.6, 2.3)},
        friction=0.183,
        speed=1.687,
        step_length=0.4752,
        limits=Limits(torque=10.72),
        transcription=Collocation(intervals=20),
    )
    problem = problem.replace(stability=StabilityBound(radius=0.714))
    (conflict,) = solve(problem).solver.conflicts
    assert conflict.name == "speed"
    assert conflict.sufficient < 1.2


def test_the_radius_is_met_where_multipliers_coalesce_and_a_parameter_is_at_its_bound():
    """A parameter that exceeded its bound by 1e-8 changed this radius by 7e-4: the walk differed from the plan."""
    problem = SLIPPING.replace(
        free={"leg_com": (0.786, 1.039), "hip_mass": (2.176, 2.8)},
        friction=0.142,
        speed=0.696,
        step_length=None,
        limits=Limits(torque=8.44),
        stability=StabilityBound(radius=0.9245),
        transcription=Collocation(intervals=20),
    )
    gait = verify(solve(problem))
    assert gait.design["leg_com"] == 1.039
    assert gait.verification.state_error < 5e-9
    cycle = assess_stability(gait)
    assert abs(cycle.multipliers[0] - cycle.multipliers[1]) < 2e-3
    assert 0.9245 - 1e-6 < cycle.radius <= 0.9245 + 1e-8


def test_the_radius_is_met_by_differences_of_the_replayed_map(bounded):
    assert bounded.status.ok
    assert bounded.verification.passed
    law = feedforward(bounded.robot, bounded.motion)
    assert replayed_multipliers(bounded, law).max() == pytest.approx(0.5, abs=1e-6)
    assert 0.5 - 1e-6 < assess_stability(bounded).radius < 0.5 + 1e-8


def test_stability_has_a_cost(bounded):
    free = solve(PROBLEM)
    assert assess_stability(free).radius > 0.99
    assert bounded.solver.objective == pytest.approx(6.226, abs=2e-3)  # own value; 2.816 without the bound
    effect = bounded.certificate.derivative_of("spectral radius")
    looser = solve(PROBLEM.replace(stability=StabilityBound(radius=0.501), guess=WarmStart(bounded)))
    assert (looser.solver.objective - bounded.solver.objective) / 1e-3 == pytest.approx(effect, rel=0.02)


def test_a_slipping_gait_is_made_more_stable():
    gait = solve(SLIPPING.replace(stability=StabilityBound(radius=0.65)))
    assert gait.status.ok
    assert replayed_multipliers(gait, feedforward(gait.robot, gait.motion)).max() == pytest.approx(0.65, abs=1e-6)


def test_a_bound_that_is_not_active_costs_nothing():
    free, gait = (solve(SLIPPING.replace(stability=bound)) for bound in (None, StabilityBound(radius=0.95)))
    assert gait.solver.objective == pytest.approx(free.solver.objective, rel=1e-7)


@pytest.mark.slow
def test_gains_are_optimised_with_the_gait(tmp_path):
    bound = StabilityBound(radius=0.3, gain_limit=10)
    gait = solve(PROBLEM.replace(stability=bound))
    assert gait.status.ok
    assert np.max(np.abs(planned_gains(gait))) <= 10 + 1e-6
    again = load(save(gait, tmp_path / "gait.h5"))
    assert planned_gains(again) == pytest.approx(planned_gains(gait))
    assert replayed_multipliers(gait, planned_law(gait)).max() <= 0.3 + 1e-6
    assert gait.solver.objective == pytest.approx(2.81601, abs=1e-4)  # own value: that of the gait without a bound


def test_the_radius_may_be_part_of_the_objective():
    gait = solve(PROBLEM.replace(stability=StabilityBound(weight=4.0)))
    radius = assess_stability(gait).radius
    assert 0.5 < radius < 0.9
    torque = solve(PROBLEM.replace(stability=StabilityBound(radius=radius))).solver.objective
    assert gait.solver.objective == pytest.approx(torque + 4.0 * radius, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sequence", "objective", "weight", "advantage", "reduction"),
    [
        ("stick | stick", "torque_squared", 1.0, 0.01, 0.05),
        ("slip+ stick | slip+", "torque_squared", 1.0, 0.01, 0.05),
        ("slip+ stick | slip+", "cost_of_transport", 2e-3, 1e-5, 0.03),
    ],
)
def test_plan_and_gains_together_beat_gains_tuned_afterwards(sequence, objective, weight, advantage, reduction):
    """Objective: cost plus weighted radius.  Afterwards, the gains of the optimal plan are tuned for the radius.

    The search of these gains starts from those of the joint optimum.
    """
    problem = PROBLEM.replace(sequence=sequence, objective=objective, transcription=Collocation(intervals=20))
    plan = solve(problem)
    problem = problem.replace(stability=StabilityBound(weight=weight, gain_limit=0.3), guess=WarmStart(plan))
    together = solve(problem)
    assert together.status.ok
    transcription = transcribe_problem(problem, problem.transcription)
    x = transfer_solution(plan.solution, transcription, np.zeros(transcription.variables.size))[0]
    data, gains = nlp_data(transcription, problem, x), transcription.variables[Unknown.GAIN][:, 0]

    def radius(values):
        x[gains] = np.clip(values, -0.3, 0.3)
        return spectral_radius(transcription, solve_deviations(transcription, x, data))

    tuned = scipy.optimize.minimize(
        radius, planned_gains(together).ravel(), method="Nelder-Mead", options={"maxfev": 300}
    )
    assert tuned.fun < assess_stability(plan).radius - reduction
    assert together.solver.objective < plan.solver.objective + weight * tuned.fun - advantage


def test_the_conditions_hold_if_and_only_if_all_zeros_are_in_the_circle(rng):
    for size in (1, 2, 3):
        matrix = ca.SX.sym("matrix", size, size)
        conditions = ca.Function("conditions", [matrix], [jury_conditions(characteristic_coefficients(matrix, size))])
        for _ in range(300):
            sample = rng.normal(size=(size, size))
            radius = np.max(np.abs(np.linalg.eigvals(sample)))
            sample *= rng.uniform(0.8, 1.2) / radius
            zeros = np.linalg.eigvals(sample)
            allowed = size < 3 or abs(np.prod(zeros)) <= 1 - MARGIN
            assert (np.min(conditions(sample).full()) >= 0) == (allowed and np.max(np.abs(zeros)) <= 1)
        reciprocal = np.diag([2.0, 1.0, 0.5][:size])  # the conditions without a margin hold for these three
        assert np.min(conditions(reciprocal).full()) < -1e-3


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"stability": 0.5}, "stability must be a StabilityBound"),
        ({"stability": StabilityBound(radius=0.5), "transcription": MultipleShooting()}, r"Collocation\(\)"),
        ({"stability": StabilityBound(radius=0.5), "sequence": "slip+ | slip+"}, "in which the foot sticks"),
        ({"stability": StabilityBound(radius=0.5), "sequence": "slip+ stick slip- | slip+"}, "last phase that sticks"),
        ({"stability": StabilityBound(radius=0.5), "sequence": "any | any"}, "closed|any"),
    ],
)
def test_problems_without_a_bound(changes, reason):
    with pytest.raises(InputError, match=reason):
        PROBLEM.replace(**changes)


@pytest.mark.parametrize(
    "options",
    [{}, {"radius": 0.0}, {"radius": 0.002}, {"radius": 0.015}, {"radius": -1}, {"radius": 0.5, "weight": -1}],
)
def test_invalid_bounds_of_the_radius(options):
    with pytest.raises(InputError, match="StabilityBound"):
        StabilityBound(**options)
