"""A plan, or what is computed from it, that is nan is a failure and never a small number."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, Ipopt, Limits, Newton, Status, solve
from gaitopt.ocp import solver as solver_module
from gaitopt.ocp.bounds import bounds, nlp_data, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.iteration_callback import OUTPUTS, IterationCallback
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.solution import grid_solve, infeasibility, trajectory
from gaitopt.ocp.solution.diagnosis import report_inaccuracies, violations
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.problem_checks import report_clipped_guess, report_poor_scaling
from gaitopt.ocp.solution.swing_foot_checks import early_touchdown, lack_of_height
from gaitopt.ocp.solution.trajectory import BetweenNodes, check_between_nodes, reconstruct_motion
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.statement.touchdown_pose import touchdown_pose
from gaitopt.ocp.transcription.transcription import transcribe
from gaitopt.progress import silent

SLIPPING = "slip+ stick | slip+"


@pytest.fixture
def quick(reference_problem):
    return reference_problem(objective="torque_squared", transcription=Collocation(intervals=10))


@pytest.fixture(params=["stick | stick", SLIPPING])
def planned(request, reference_problem):
    """Return a problem, its transcription and a start."""
    problem = reference_problem(
        sequence=request.param, transcription=Collocation(intervals=10), limits=Limits(torque=6, clearance=0.0)
    )
    transcription = transcribe(structure(problem, problem.transcription))
    return problem, transcription, initial_point(transcription, problem, LinearGuess())


@pytest.mark.parametrize("table", ["torque", "angles", "rates"])
def test_a_plan_that_is_nan_drifts_infinitely_between_its_nodes(planned, table):
    problem, transcription, x = planned
    assert math.isfinite(check_between_nodes(transcription, problem.values, x).drift)
    x[transcription.variables[table][0, 3]] = np.nan
    found = check_between_nodes(transcription, problem.values, x)
    assert found.drift == math.inf
    assert found.outside == math.inf or table != "torque"  # it follows from the first node and the torques


def test_works_that_are_infinite_between_nodes_are_read_without_a_warning(planned, monkeypatch):
    problem, transcription, x = planned
    integrate = trajectory._integrate_intervals
    monkeypatch.setattr(trajectory, "_integrate_intervals", lambda *arguments: integrate(*arguments) + np.inf)
    assert np.isnan(reconstruct_motion(transcription, problem.values, x).segments[0].work).any()


def test_a_swing_foot_that_is_nan_is_too_low(planned):
    problem, transcription, x = planned
    assert lack_of_height(transcription, problem, x) < 1
    x[transcription.variables["angles"][0, 3]] = np.nan
    assert lack_of_height(transcription, problem, x) == math.inf


def test_a_guard_that_is_nan_is_an_early_touchdown(planned):
    problem, transcription, x = planned
    x[transcription.variables["angles"][1, -2]] += 0.1  # above the ground before the last node
    assert early_touchdown(transcription, problem, x) is None
    x[transcription.variables["angles"][0, 3]] = np.nan
    assert early_touchdown(transcription, problem, x).place.endswith("node 3")


def test_errors_that_are_nan_are_inaccuracies(planned):
    problem, transcription, x = planned
    between = BetweenNodes(math.nan, math.nan, math.nan)
    said = " ".join(report_inaccuracies(transcription, problem, x, math.nan, between))
    assert "the error between nodes is nan" in said
    assert "contact mode is violated by nan" in said
    assert "is nan" not in " ".join(report_inaccuracies(transcription, problem, x, 0.0, BetweenNodes(0.0, 0.0)))
    between = BetweenNodes(0.0, 0.0, math.nan)
    assert "distance from another mode is nan" in " ".join(report_inaccuracies(transcription, problem, x, 0.0, between))


def test_violations_that_are_nan_come_first(planned):
    problem, transcription, x = planned
    limits, g = bounds(transcription, problem), np.zeros(transcription.nlp.n_constraints)
    g[7] = np.nan
    assert violations(transcription, limits, x, g)[0].size == math.inf


def test_a_guess_that_is_nan_is_outside_its_bounds(planned):
    problem, transcription, x = planned
    x[transcription.variables["angles"][0, 3]] = np.nan
    assert "outside its bounds by inf" in report_clipped_guess(transcription, bounds(transcription, problem), x)[0]


def test_a_derivative_that_is_nan_is_named(planned):
    problem, transcription, x = planned
    x[transcription.variables["angles"][0, 3]] = np.nan
    assert "no finite derivative" in report_poor_scaling(transcription, x, nlp_data(transcription, problem))[0]


def test_a_plan_that_is_not_finite_between_its_nodes_is_no_solution(quick, monkeypatch):
    """It once was 'solved' with an error of 0."""
    assert solve(quick).status is Status.SOLVED
    monkeypatch.setattr(grid_solve, "check_between_nodes", lambda *_: BetweenNodes(math.inf, 0.0))
    gait = solve(quick)
    assert gait.status is Status.INVALID_NUMBER
    assert "not finite between its nodes" in gait.solver.message


class _Answer:
    """A solver that returns its start as a solution, with something made nan."""

    def __init__(self, **changes):
        self.changes = changes

    def minimise(self, nlp, x, data, limits, observer, multipliers=None, barrier=0.0):
        g = np.zeros(nlp.n_constraints)
        outcome = NlpResult(Status.SOLVED, "done", x, g, 1.0, 1, (0 * x, 0 * g))
        return replace(outcome, **{name: change(getattr(outcome, name)) for name, change in self.changes.items()})


@pytest.mark.parametrize("name", ["x", "g", "objective"])
def test_an_answer_that_is_nan_is_no_solution(quick, name):
    solver = _Answer(**{name: lambda value: value * np.nan})
    start = SingleStart(quick, LinearGuess(), solver, silent)
    assert start.solve_on_grid(quick.transcription, None, 1e-6).outcome.status is Status.INVALID_NUMBER


@pytest.mark.parametrize("nan_first", [True, False])
def test_a_start_whose_cost_is_nan_is_not_the_cheapest(quick, monkeypatch, nan_first):
    gait = solve(quick)
    costs = [math.nan, 1.0] if nan_first else [1.0, math.nan]
    found = [replace(gait, solver=replace(gait.solver, objective=cost)) for cost in costs]
    monkeypatch.setattr(solver_module, "solve_from_starts", lambda *_, **__: found)
    monkeypatch.setattr(infeasibility, "conclude_failure", lambda problem, failure, *_: failure)
    assert solve(quick, starts=2).solver.objective == 1.0


@pytest.mark.parametrize("nan_first", [True, False])
def test_a_failure_whose_violation_is_nan_is_not_the_nearest(quick, monkeypatch, nan_first):
    gait = replace(solve(quick), status=Status.INFEASIBLE)
    sizes = [math.nan, 1.0] if nan_first else [1.0, math.nan]
    sizes = (*sizes, 2.0, 3.0)
    found = iter([replace(gait, solver=replace(gait.solver, constraint_violation=size)) for size in sizes])
    monkeypatch.setattr(solver_module, "solve_from_starts", lambda *_, **__: [next(found)])
    monkeypatch.setattr(solver_module, "solve_from_start", lambda *_: next(found))
    monkeypatch.setattr(infeasibility, "conclude_failure", lambda problem, failure, *_: failure)
    assert solve(quick).solver.constraint_violation == 1.0


def _seen_by_the_tap(g, f):
    """Return (violation that the observer receives, whether the iterate is kept) for values of an NLP."""
    told, tap = [], IterationCallback(Nlp(functions={}, derivatives={}, objective=None, n_variables=2, n_constraints=2))
    nothing = np.zeros(0)
    tap.watch(
        lambda iteration: told.append(iteration.infeasibility),
        Bounds(nothing, nothing, np.zeros(2), np.ones(2)),
        math.inf,
        1000,
    )
    values = {"x": [0, 0], "f": [f], "g": g, "lam_x": [0, 0], "lam_g": [0, 0]}
    tap.record({name: np.array(values.get(name, []), dtype=float) for name in OUTPUTS})
    return told[0], tap.best is not None


def test_an_iterate_that_is_nan_is_not_kept():
    assert _seen_by_the_tap([0.5, 0.5], 1.0) == (0.0, True)
    assert _seen_by_the_tap([np.nan, 0.5], 1.0) == (math.inf, False)
    assert _seen_by_the_tap([0.5, 0.5], np.nan)[1] is False


def test_newtons_method_does_not_arrive_at_nan(reference_problem):
    problem = reference_problem(objective="torque_squared", parameters={"leg_mass": 1e-300})
    assert not solve(problem, solver=Newton(fallback=Ipopt(max_iterations=3))).status.ok


def test_a_pose_that_is_nan_is_no_pose(compass):
    broken = compass.landing
    q, v, p = (ca.SX.sym(broken.name_in(i), broken.sparsity_in(i)) for i in range(3))
    outputs = [output * np.nan for output in broken(q, v, p)]
    robot = replace(compass, landing=ca.Function("landing", [q, v, p], outputs))
    with pytest.raises(Exception, match="no touchdown pose"):
        touchdown_pose(robot, robot.resolve({}), 0.4)


def test_the_motion_of_a_start_without_durations_can_be_read(planned):
    problem, transcription, x = planned
    x[transcription.variables["duration"]] = 0.0
    motion = reconstruct_motion(transcription, problem.values, x)
    assert motion.period == 0.0
