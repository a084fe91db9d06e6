"""What is odd about a problem before it is solved is said by name."""

import pytest

from gaitopt import Ipopt, Keyframes, Limits, LinearGuess, Status, solve
from gaitopt.ocp.bounds import bounds, nlp_data, structure
from gaitopt.ocp.initial.initial_point import initial_point, point_from_guess
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.solution.problem_checks import report_clipped_guess, report_poor_scaling
from gaitopt.ocp.transcription.transcription import transcribe


def test_a_guess_outside_the_bounds_is_named_with_its_worst_place(reference_problem):
    wild = Keyframes((0, 0.5, 1), {"th1": (-0.15, 0, 0.15), "th2": (-0.15, 1.3, 0.15)})
    gait = solve(reference_problem(guess=wild, intervals=10, limits=Limits(torque=6, angle=0.5)))
    (remark,) = [text for text in gait.solver.warnings if "guess" in text]
    assert remark == (
        "the guess has th2 outside its bounds by 0.8 at phase 1 (stick), node 5; it was moved inside them."
    )


def test_a_guess_inside_the_bounds_and_an_automatic_one_are_not_remarked_on(reference_problem):
    for guess in (None, LinearGuess()):
        gait = solve(reference_problem(guess=guess, intervals=10))
        assert gait.status is Status.SOLVED
        assert gait.solver.warnings == ()


def test_a_slide_that_keyframes_cannot_state_is_not_remarked_on(reference_problem):
    """Keyframes have no slide; a foot at rest lies outside the bounds of a slip phase by their margin."""
    frames = Keyframes((0, 1), {"th1": (-0.15, 0.15), "th2": (-0.15, 0.15)})
    problem = reference_problem(guess=frames, intervals=10, sequence="slip+ stick | slip+")
    transcription = transcribe(structure(problem, problem.transcription))
    limits, guessed = bounds(transcription, problem), point_from_guess(transcription, problem, frames)
    assert report_clipped_guess(transcription, limits, guessed) == ()
    guessed[transcription.variables[Unknown.SLIDE, 0][1, 2]] = -0.3
    (remark,) = report_clipped_guess(transcription, limits, guessed)
    assert remark.startswith("the guess has foot speed outside its bounds by 0.31 at phase 1 (slip+), node 2")


def test_a_parameter_off_by_orders_of_magnitude_is_suspected(reference_problem):
    problem = reference_problem(parameters={"hip_mass": 2e9}, intervals=10)
    gait = solve(problem, solver=Ipopt(max_iterations=20))
    assert not gait.status.ok
    assert any("badly scaled" in text for text in gait.solver.warnings)


def test_a_well_scaled_problem_is_not_suspected(reference_problem):
    problem = reference_problem(intervals=10)
    transcription = transcribe(structure(problem, problem.transcription))
    x = initial_point(transcription, problem, LinearGuess())
    assert report_poor_scaling(transcription, x, nlp_data(transcription, problem)) == ()
    assert report_clipped_guess(transcription, bounds(transcription, problem), x) == ()
    assert point_from_guess(transcription, problem, LinearGuess()) == pytest.approx(x, abs=1e-2)
