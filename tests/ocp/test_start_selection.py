"""Starts on the coarsest grid: which are solved, which are refined, and what an interrupt leaves of them."""

import numpy as np
import pytest
from attrs import frozen

from gaitopt import Collocation, GaitProblem, InputError, Limits, LinearGuess, Newton, RandomPerturbation, Status, solve
from gaitopt.ocp import solver
from gaitopt.ocp.solution import start_selection
from gaitopt.ocp.solution.iteration_limits import limit_iterations
from gaitopt.ocp.solution.start_selection import is_same_solution, list_starts, solve_from_starts
from gaitopt.ocp.statement.initial_guess import DelayedSwing
from gaitopt.progress import silent
from tests.benchmarks.random_problems import draw_problem
from tests.ocp.test_single_start import iterations

SLIP, STARTS = "slip+ stick | slip+", 3


def stop_in_run(number, iteration=2):
    """Return an observer that interrupts one run of the solver, counted from 1, and the list of the seen iterations."""
    seen = []

    def observe(step):
        seen.append(step)
        if len(iterations(seen)) == number and step.number == iteration:
            raise KeyboardInterrupt

    return observe, seen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "guess"),
    [
        (12, "linear guess with a delayed swing"),  # a line leads to a swing leg that waits in front of the walker
        (31, "a gait of least squared torques, 'stick | stick'"),
    ],
)
def test_a_better_optimum_than_that_of_a_line_is_the_default(number, guess):
    problem = draw_problem(number)
    line, default = solve(problem, starts=1), solve(problem)
    assert line.status is default.status is Status.SOLVED
    assert line.problem["guess"] == "linear guess"
    assert default.problem["guess"] == guess
    assert default.solver.objective < 0.995 * line.solver.objective


def test_two_default_solves_agree_to_the_last_bit():
    one, other = solve(draw_problem(31)), solve(draw_problem(31))
    for name, table in one.solution.unknowns.items():
        np.testing.assert_array_equal(table.values, other.solution.unknowns[name].values)


def test_of_equal_solutions_the_first_start_is_kept(reference_problem):
    problem = reference_problem(sequence=SLIP)
    line, default = solve(problem, starts=1), solve(problem)
    assert default.problem["guess"] == f"a gait of least squared torques, '{SLIP}'"
    assert default.solver.objective == pytest.approx(line.solver.objective, rel=1e-6)


def test_the_report_counts_the_iterations_of_all_starts(reference_problem):
    seen = []
    gait = solve(reference_problem(sequence=SLIP), observer=seen.append)
    assert gait.solver.iterations == sum(iterations(seen))
    assert solve(reference_problem(sequence=SLIP), starts=1).solver.iterations < gait.solver.iterations


@pytest.mark.parametrize("run", [1, 2, 3, 4, 5])
def test_an_interrupt_of_a_start_keeps_the_earlier_ones(reference_problem, run):
    """Runs: squared torques, its start; the same of the sticking sequence; delayed swing."""
    observe, seen = stop_in_run(run)
    gait = solve(reference_problem(sequence=SLIP), starts=STARTS, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert len(iterations(seen)) == run
    assert gait.solver.iterations == sum(iterations(seen))
    assert gait.problem["intervals"] == [5, 10]
    if run == 1:
        assert gait.problem["guess"] == "linear guess"
    else:
        assert gait.problem["guess"] == f"a gait of least squared torques, '{SLIP}'"
    if run > 2:
        assert gait.solver.constraint_violation <= 1e-6
        assert "the result is the solution before this refinement" in gait.solver.message


@pytest.mark.slow
def test_an_interrupt_of_a_second_refinement_is_reported_with_the_first_gait(monkeypatch):
    monkeypatch.setattr(start_selection, "COST_RANGE", 0.05)
    problem, runs = draw_problem(12), []
    gaits = run_starts(problem, runs.append)
    assert len(gaits) == 2
    observe, _ = stop_in_run(len(iterations(runs)))
    (gait,) = run_starts(problem, observe)
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.objective == gaits[0].solver.objective
    assert "the result is the gait of another start" in gait.solver.message
    assert solve(problem, starts=STARTS, observer=stop_in_run(len(iterations(runs)))[0]).status is Status.INTERRUPTED


@pytest.mark.slow
def test_starts_after_equal_motions_or_solutions_are_not_tried(reference_problem, monkeypatch):
    problem = reference_problem(sequence=SLIP)
    best_of_three, after_equal_motions = solve(problem, starts=STARTS).solver, solve(problem).solver
    monkeypatch.setattr(start_selection, "NEAR_ANGLES", 0.0)
    after_equal_solutions = solve(problem).solver
    assert after_equal_motions.iterations < after_equal_solutions.iterations < best_of_three.iterations
    assert after_equal_motions.objective == pytest.approx(best_of_three.objective, rel=1e-9)
    assert after_equal_solutions.objective == pytest.approx(best_of_three.objective, rel=1e-9)
    monkeypatch.setattr(start_selection, "is_same_solution", lambda *arguments: False)
    assert solve(problem).solver.iterations >= best_of_three.iterations


def run_starts(problem, observer=silent):
    """Return the gaits of some starts."""
    return solve_from_starts(problem, list_starts(problem, STARTS), Newton(), observer, limit_iterations(Newton()))


def test_if_the_first_start_fails_no_other_is_solved(reference_problem):
    seen = []
    problem = reference_problem(sequence=SLIP, limits=Limits(torque=0.05))
    (failure,) = run_starts(problem, seen.append)
    assert not failure.status.ok
    assert failure.problem["guess"] == "linear guess"
    assert len(iterations(seen)) == 2  # squared torques, and the line as none was found


@pytest.mark.slow
def test_after_a_failure_with_a_feasible_motion_the_other_starts_are_solved_too(monkeypatch):
    listed, solved, solve_some = [LinearGuess(), DelayedSwing()], [], solve_from_starts

    def record(problem, starts, *arguments, **options):
        solved.append(starts)
        return solve_some(problem, starts, *arguments, **options)

    monkeypatch.setattr(solver, "list_starts", lambda problem, count: listed)
    monkeypatch.setattr(solver, "solve_from_starts", record)
    gait = solve(draw_problem(5))  # a line needs more iterations than the first start has
    assert gait.status is Status.SOLVED
    assert solved == [listed, listed[1:]]


def test_a_neighbour_without_a_solution_is_omitted(reference_problem):
    problem = reference_problem(sequence=SLIP)
    impossible = problem.replace(sequence="stick | stick", limits=Limits(torque=1e-3))
    starts = [LinearGuess(), impossible]
    (gait,) = solve_from_starts(problem, starts, Newton(), silent, limit_iterations(Newton()))
    assert gait.status is Status.SOLVED
    assert gait.problem["guess"] == "linear guess"


def labels(problem, count=None):
    """Return the guesses and the names of the neighbouring problems in the starts of a problem."""
    starts = list_starts(problem, count)
    return [start.name if isinstance(start, GaitProblem) else start.describe() for start in starts]


def test_the_starts_have_a_fixed_order(reference_problem):
    torques, delayed = "a gait of least squared torques, ", "linear guess with a delayed swing"
    assert labels(reference_problem()) == [f"{torques}'stick | stick'", delayed]
    assert labels(reference_problem(sequence=SLIP)) == [f"{torques}'{SLIP}'", f"{torques}'stick | stick'", delayed]
    assert labels(reference_problem(objective="torque_squared")) == ["linear guess"]
    assert labels(reference_problem(objective="torque_squared"), 2) == ["linear guess", delayed]
    assert labels(reference_problem(), 1) == ["linear guess"]
    further = ["linear guess", "randomly perturbed linear guess, seed 1", "randomly perturbed linear guess, seed 2"]
    assert labels(reference_problem(), 5) == [f"{torques}'stick | stick'", delayed, *further]
    guess = RandomPerturbation(7)
    assert labels(reference_problem(guess=guess)) == [guess.describe()]
    assert labels(reference_problem(guess=guess), 2) == [guess.describe(), f"{torques}'stick | stick'"]


@pytest.mark.parametrize("intervals", [(7, 30), 40])
def test_a_neighbouring_problem_has_the_coarsest_grid(reference_problem, intervals):
    problem = reference_problem(sequence=SLIP, transcription=Collocation(intervals=intervals))
    same, sticking, _ = list_starts(problem)
    assert same.transcription.intervals_for(same.sequence) == (5, 10)
    assert sticking.transcription.intervals_for(sticking.sequence) == (10,)
    assert same.limits == sticking.limits == problem.limits


@pytest.mark.parametrize(
    ("costs", "durations", "same"),
    [
        ((1.0, 1.0 + 1e-7), ([0.1, 0.6], [0.2, 0.5]), True),
        ((1.0, 1.0 + 5e-5), ([0.1, 0.6], [0.1, 0.6]), True),
        ((1.0, 1.0 + 5e-5), ([0.1, 0.6], [0.2, 0.5]), False),
        ((1.0, 1.001), ([0.1, 0.6], [0.1, 0.6]), False),
    ],
)
def test_solutions_are_the_same_by_cost_and_durations(costs, durations, same):
    assert is_same_solution(costs, tuple(map(np.array, durations)), 1.0) is same


@frozen(kw_only=True)
class _WithoutGrids(Collocation):
    def list_grids(self, sequence):
        return []


@pytest.mark.parametrize("starts", [None, 1])
def test_a_transcription_without_grids_is_rejected(reference_problem, starts):
    problem = reference_problem(transcription=_WithoutGrids(intervals=10))
    with pytest.raises(InputError, match="list_grids must return at least one grid, got none"):
        solve(problem, starts=starts)
